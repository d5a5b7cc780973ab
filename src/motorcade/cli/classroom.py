"""The command `motorcade class`: a class in one room."""

import secrets
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from motorcade.cli.options import (
    CarList,
    Json,
    TcpPortNumber,
    current_language,
    listed,
    print_lines,
    print_problem,
    print_result,
    translated,
    wants_json,
)
from motorcade.cli.pages import Cameras, KeysFile, LogFile, named_cars, open_browser
from motorcade.extras import needs_extra
from motorcade.sockets import is_loopback

app = typer.Typer()
_KEY_BYTES = 12


@app.command("class")
def _class(
    folder: Annotated[Path | None, typer.Option(file_okay=False)] = None,
    host: str = "0.0.0.0",
    port: TcpPortNumber = 7710,
    https: Annotated[bool, typer.Option("--https")] = False,
    new_password: Annotated[bool, typer.Option("--new-password")] = False,
    car: Annotated[list[str] | None, typer.Option(metavar="NAME=HOST[:PORT]")] = None,
    keys: KeysFile = None,
    camera: Cameras = None,
    car_list: CarList = None,
    log: LogFile = None,
    no_browser: Annotated[bool, typer.Option("--no-browser")] = False,
    as_json: Json = False,
) -> None:
    with needs_extra("class", "class"):
        import motorcade.engine.webassembly  # noqa: F401  # before a page asks for a world
        from motorcade.classroom.app import make_class_app
        from motorcade.classroom.folder import ClassFolder
        from motorcade.classroom.network import LOCAL_NAME, Network, class_keys, join_url, qr_for_terminal, room_hosts
        from motorcade.classroom.running import ClassServerSettings
        from motorcade.server.http import check_page
        from motorcade.server.running import names_of, serve_alone, url_of
    check_page()
    from motorcade.drive.activity_log import logging_to
    from motorcade.drive.keys import https_context
    from motorcade.drive.listener import bind
    from motorcade.fleet.places import CLASS, announced

    named = named_cars(car or (), camera or (), keys)
    place = folder or Path(typer.get_app_dir("motorcade")) / "class"
    files = ClassFolder(place)
    with files.opened(), bind(host, port, "class") as listener, logging_to(log, print_problem) as written:
        record = files.load(secrets.randbelow)
        hosts, own = room_hosts(listener)
        first_key = secrets.token_urlsafe(_KEY_BYTES) if new_password or record.password is None else None
        own_keys, authority = class_keys(place / "https", hosts, datetime.now(UTC)) if https else (None, None)
        scheme, bound = "https" if https else "http", listener.getsockname()[1]
        reaches_others = not is_loopback(listener)
        settings = ClassServerSettings(
            library=place,
            port=bound,
            names=frozenset([*names_of(listener, host), LOCAL_NAME]),
            record=written.record if written else None,
            first_key=first_key,
            network=Network(hosts, bound, scheme, announces=reaches_others),
            authority=authority,
            places=tuple(listed(car_list)),
            **named,
        )
        teacher = url_of(own, bound, page="/teacher", scheme=scheme) + (f"#{first_key}" if first_key else "")
        app = make_class_app(settings, files)

        def ready() -> None:
            network = settings.network
            code = files.load(secrets.randbelow).code
            found = {
                "addresses": network.addresses,
                "local_name": network.local_name,
                "code": code,
                "teacher": teacher,
                "folder": str(place),
            }
            lines = [translated("class-is-ready", addresses="  ".join(network.addresses), code=code, folder=place)]
            if network.local_name:
                lines.append(translated("class-has-name", url=network.local_name))
            elif network.why_no_name:
                lines.append(network.why_no_name.sentence(current_language()))
            lines.append(translated("class-first-password" if first_key else "class-teacher", url=teacher))
            if files.problem:
                lines.append(files.problem.sentence(current_language()))
            if reaches_others and not https:
                lines.append(translated("class-insecure"))
            print_result(found, "\n".join(lines), as_json)
            if not wants_json(as_json):
                print_lines([qr_for_terminal(join_url(network.addresses[0], code))])
            if not no_browser:
                open_browser(teacher)

        with announced(CLASS, record.title, listener.getsockname()[:2], print_problem):
            serve_alone(app, settings, listener, ready, https_context(own_keys) if own_keys else None)
