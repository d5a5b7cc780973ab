"""Commands that serve pages, studio, class and drive remote, or write one, site; the page of `drive serve`."""

import os
import secrets
import socket
import ssl
import sys
import threading
import webbrowser
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from motorcade.cli import options
from motorcade.cli.output import print_lines, print_problem, print_result, quoted, sentence_of, translated, wants_json
from motorcade.config.files import raised_as, read_bytes, write_secret
from motorcade.errors import MotorcadeError
from motorcade.extras import needs_extra
from motorcade.sockets import is_loopback

if TYPE_CHECKING:
    from motorcade.cameras.broadcast import Source
    from motorcade.drive.session import CarControl
    from motorcade.server.fleet import RemoteCar

_METAVAR = "NAME=HOST[:PORT]"
_TOKEN_FILE = ".token"
_TOKEN_CHARACTERS = 32
_FIRST_KEY_BYTES = 12

remote_app = typer.Typer()
studio_app = typer.Typer()
# Where a real car's pictures come from.
CameraName = Literal["none", "auto", "picamera2", "opencv"]


def check_reach(listener: socket.socket, keys: Path | None, insecure_lan: bool, refusal: str, warning: str) -> None:
    """Refuse an address that others reach without keys, unless ``insecure_lan`` allows it; then print a warning.

    Args:
        refusal: the code of the MotorcadeError that is raised.
        warning: the key of the sentence that is printed.
    """
    if is_loopback(listener) or keys:
        return
    host = listener.getsockname()[0]
    if not insecure_lan:
        raise MotorcadeError(refusal, host=host)
    print(translated(warning, host=host), file=sys.stderr, flush=True)


def _page_tls(listener: socket.socket, keys: Path | None, insecure_lan: bool) -> ssl.SSLContext | None:
    """HTTPS of a page of its own, or None where plain HTTP is allowed. Raises MotorcadeError."""
    from motorcade.drive.keys import https_context

    check_reach(listener, keys, insecure_lan, "page-without-https", "page-insecure")
    if keys:
        return https_context(keys)
    return None


def open_camera(name: CameraName) -> "Source | None":
    """A real car's camera. Raises MotorcadeError where the requested camera isn't there."""
    from motorcade.cameras.broadcast import OpenCvCamera, PiCamera, find_camera

    if name == "none":
        return None
    return {"auto": find_camera, "picamera2": PiCamera, "opencv": OpenCvCamera}[name]()


def load_page() -> None:
    """Import what the page needs, as long as no car waits for it. Raises MotorcadeError where an extra is missing."""
    with needs_extra("car-page", "drive"):
        import motorcade.server.remote
        import motorcade.server.running  # noqa: F401
        from motorcade.server.http import check_page
    check_page()


def page_address(
    listener: socket.socket, host: str, page: str = "/", tls: ssl.SSLContext | None = None, token: str | None = None
) -> tuple[str, dict[str, Any]]:
    """The whole address of a page, and what `motorcade.server.request_filter.ServerSettings` needs to know of it.

    An address that other computers reach has a new secret token; one of this computer alone has ``token``, if any.
    """
    from motorcade.server.running import names_of, url_of

    names = names_of(listener, host)
    port = listener.getsockname()[1]
    if not is_loopback(listener):
        token = secrets.token_urlsafe(24)
    url = url_of(names[0], port, token, page, "https" if tls else "http")
    return url, {"port": port, "names": frozenset(names), "token": token}


@asynccontextmanager
async def serving_page(
    listener: socket.socket, host: str, tls: ssl.SSLContext | None, source: "Source | None", control: "CarControl"
) -> AsyncIterator[str]:
    """Serve the car's page while the block runs; gives its whole address. `load_page` comes first.

    Args:
        listener: where it listens.
        host: the address that the user gave.
        tls: for HTTPS; None for HTTP.
        source: where its pictures come from, if it has a camera.
        control: the car.
    """
    from motorcade.cameras.broadcast import Camera
    from motorcade.server.fleet import SingleCar
    from motorcade.server.remote import make_remote
    from motorcade.server.request_filter import ServerSettings
    from motorcade.server.running import serving

    url, where = page_address(listener, host, "/drive", tls)
    settings = ServerSettings(**where)
    camera = None
    if source:
        camera = Camera(source)
    try:
        async with serving(make_remote(settings, SingleCar(control, camera)), settings, listener, tls):
            yield url
    finally:
        if camera:
            await camera.close()


@remote_app.command("remote")
def _remote(
    cars: Annotated[list[str], typer.Argument(metavar=f"{_METAVAR}…")],
    keys: options.KeysFile = None,
    camera: options.Cameras = None,
    host: options.Host = "127.0.0.1",
    port: options.TcpPortOption = 7701,
    page_keys: options.PageKeys = None,
    insecure_lan: options.InsecureLan = False,
    log: options.LogFile = None,
) -> None:
    with needs_extra("remote", "drive"):
        from motorcade.server.fleet import RemoteCars
        from motorcade.server.http import check_page
        from motorcade.server.remote import make_remote
        from motorcade.server.request_filter import ServerSettings
        from motorcade.server.running import serve_alone
    from motorcade.drive.activity_log import logging_to
    from motorcade.drive.listener import bind

    check_page()
    options.exclude_each_other(https=page_keys, insecure_lan=insecure_lan)
    named = named_cars(cars, camera, keys)
    with bind(host, port, "remote") as listener, logging_to(log, print_problem) as record_of_drivers:
        tls = _page_tls(listener, page_keys, insecure_lan)
        url, where = page_address(listener, host, "/drive", tls)
        settings = ServerSettings(**where, record=record_of_drivers)
        names = [car.name for car in named["cars"]]

        def ready() -> None:
            sentence = translated("remote-is-ready", cars=", ".join(names), url=url)
            print_result({"url": url, "cars": names}, sentence)

        serve_alone(make_remote(settings, RemoteCars(**named)), settings, listener, ready, tls)


def named_cars(texts: Sequence[str], cameras: Sequence[str] | None, keys: Path | None) -> dict[str, Any]:
    """The cars that the command line names, as `motorcade.server.fleet.RemoteCars` takes them.

    Raises MotorcadeError.
    """
    from motorcade.cameras.broadcast import WebCamera
    from motorcade.drive.keys import client_context, visitor_context

    urls = dict(_pair(text, "not-name-and-url") for text in cameras or ())
    trust = None
    if urls:
        trust = visitor_context(keys)
    cars = tuple(_car(text, urls) for text in texts)
    names = [car.name for car in cars]
    if twice := [name for name in names if names.count(name) > 1]:
        raise MotorcadeError("cars-of-one-name", name=twice[0])
    for name, url in urls.items():
        if name not in names:
            raise MotorcadeError("camera-without-car", name=name)
        with raised_as("camera-of-car", car=name):
            WebCamera(url, trust)
    return {"cars": cars, "keys": client_context(keys, takes_chips=True) if keys else None, "trust": trust}


def _car(text: str, urls: dict[str, str]) -> "RemoteCar":
    from motorcade.server.fleet import RemoteCar, is_name

    name, where = _pair(text, "not-name-and-host", form=_METAVAR)
    if not is_name(name):
        raise MotorcadeError("not-a-car-name", name=name)
    where, slash, telemetry = where.removeprefix(options.DRIVE_SCHEME).partition("/")
    host, port = options.car_address(where)
    if slash and not (telemetry.isascii() and telemetry.isdigit() and 0 < int(telemetry) < 65536):
        raise MotorcadeError("not-a-telemetry-port", text=telemetry, name=name)
    return RemoteCar(name, host, port, int(telemetry) if slash else None, urls.get(name))


def _pair(text: str, code: str, **details: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals or not name or not value:
        raise MotorcadeError(code, text=text, **details)
    return name, value


@studio_app.command("studio")
def _studio(
    port: options.TcpPortOption = 7700,
    host: options.Host = "127.0.0.1",
    library: Annotated[Path | None, typer.Option(file_okay=False)] = None,
    car: options.CarsOption = None,
    keys: options.KeysFile = None,
    camera: options.Cameras = None,
    car_list: options.CarListOption = None,
    page_keys: options.PageKeys = None,
    insecure_lan: options.InsecureLan = False,
    log: options.LogFile = None,
    no_browser: options.NoBrowser = False,
) -> None:
    with needs_extra("studio", "studio"):
        import motorcade.engine.webassembly  # noqa: F401  # before the page asks for a world
        from motorcade.server.http import check_page
        from motorcade.server.running import serve_alone
        from motorcade.server.studio.app import make_app
        from motorcade.server.studio.sessions import Settings
    from motorcade.drive.activity_log import logging_to
    from motorcade.fleet.places import STUDIO, announced

    check_page()
    options.exclude_each_other(https=page_keys, insecure_lan=insecure_lan)
    named = named_cars(car or (), camera, keys)
    folder = library or options.own_folder() / "projects"
    token = own_token(folder)
    with _listen(host, port, token) as listener, logging_to(log, print_problem) as record_of_drivers:
        tls = _page_tls(listener, page_keys, insecure_lan)
        url, where = page_address(listener, host, tls=tls, token=token)
        places = tuple(options.listed(car_list))
        settings = Settings(library=folder, record=record_of_drivers, places=places, **where, **named)

        def ready() -> None:
            sentence = translated("studio-is-ready", url=url, folder=folder)
            print_result({"url": url, "library": str(folder)}, sentence)
            if not no_browser:
                open_browser(url)

        with announced(STUDIO, "", listener.getsockname()[:2], print_problem):
            serve_alone(make_app(settings), settings, listener, ready, tls)


@studio_app.command("class")
def _class(
    folder: Annotated[Path | None, typer.Option(file_okay=False)] = None,
    host: options.Host = "0.0.0.0",
    port: options.TcpPortOption = 7710,
    https: Annotated[bool, typer.Option("--https")] = False,
    new_password: Annotated[bool, typer.Option("--new-password")] = False,
    car: options.CarsOption = None,
    keys: options.KeysFile = None,
    camera: options.Cameras = None,
    car_list: options.CarListOption = None,
    log: options.LogFile = None,
    no_browser: options.NoBrowser = False,
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

    named = named_cars(car or (), camera, keys)
    place = folder or options.own_folder() / "class"
    files = ClassFolder(place)
    with files.opened(), bind(host, port, "class") as listener, logging_to(log, print_problem) as record_of_drivers:
        record = files.load(secrets.randbelow)
        hosts, own = room_hosts(listener)
        first_key = None
        if new_password or record.password is None:
            first_key = secrets.token_urlsafe(_FIRST_KEY_BYTES)
        scheme = "http"
        tls = None
        authority = None
        if https:
            own_keys, authority = class_keys(place / "https", hosts, datetime.now(UTC))
            scheme = "https"
            tls = https_context(own_keys)
        bound = listener.getsockname()[1]
        reaches_others = not is_loopback(listener)
        settings = ClassServerSettings(
            library=place,
            port=bound,
            names=frozenset([*names_of(listener, host), LOCAL_NAME]),
            record=record_of_drivers,
            first_key=first_key,
            network=Network(hosts, bound, scheme, announces=reaches_others),
            authority=authority,
            places=tuple(options.listed(car_list)),
            **named,
        )
        teacher = url_of(own, bound, page="/teacher", scheme=scheme)
        teacher_line = "class-teacher"
        if first_key:
            teacher = f"{teacher}#{first_key}"
            teacher_line = "class-first-password"
        app = make_class_app(settings, files)

        def ready() -> None:
            addresses = settings.network.addresses
            name = settings.network.local_name
            code = files.load(secrets.randbelow).code
            found = {"addresses": addresses, "local_name": name, "code": code, "teacher": teacher, "folder": str(place)}
            lines = [translated("class-is-ready", addresses="  ".join(addresses), code=code, folder=place)]
            if name:
                lines.append(translated("class-has-name", url=name))
            elif settings.network.why_no_name:
                lines.append(sentence_of(settings.network.why_no_name))
            lines.append(translated(teacher_line, url=teacher))
            if files.problem:
                lines.append(sentence_of(files.problem))
            if reaches_others and not https:
                lines.append(translated("class-insecure"))
            print_result(found, "\n".join(lines))
            if not wants_json():
                print_lines([qr_for_terminal(join_url(addresses[0], code))])
            if not no_browser:
                open_browser(teacher)

        with announced(CLASS, record.title, listener.getsockname()[:2], print_problem):
            serve_alone(app, settings, listener, ready, tls)


@studio_app.command("site")
def _site(output: options.Output) -> None:
    with needs_extra("site", "studio"):
        from motorcade.browser.site import site_files, write_site

    files = site_files()
    write_site(output, files)
    count = len(files)
    size = sum(map(len, files.values()))
    details = {"files": count, "megabytes": f"{size / 1e6:.1f}"}
    sentence = translated("site-is-written", folder=output, argument=quoted(output), **details)
    print_result({"folder": str(output), "files": count, "bytes": size}, sentence)


def own_token(folder: Path) -> str:
    """The token of whom ``folder`` belongs to: other users of this computer can't read it.

    It is made at the first start and stays, so that the page's address stays good.
    """
    file = folder / _TOKEN_FILE
    with suppress(OSError, UnicodeError, MotorcadeError):
        token = read_bytes(file).decode("ascii")
        if len(token) >= _TOKEN_CHARACTERS:
            return token
    token = secrets.token_urlsafe(_TOKEN_CHARACTERS * 3 // 4)
    # A folder that can't be written to has a new token at each start.
    with suppress(OSError):
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        file.unlink(missing_ok=True)
        write_secret(file, token.encode())
    return token


def _listen(host: str, port: int, token: str) -> socket.socket:
    """A socket that listens at the address; port 0 takes a free one. Raises MotorcadeError."""
    from motorcade.drive.listener import PortTakenError, bind
    from motorcade.server.running import url_of

    try:
        return bind(host, port, "studio")
    except PortTakenError:
        # At 'all addresses' no page can be opened; this computer is one of them.
        here = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)
        raise MotorcadeError("studio-port-taken", port=port, url=url_of(here, port, token)) from None


def open_browser(url: str) -> None:
    """Show ``url`` in the browser, if there is one with a window; doesn't wait for it."""
    # Without a display Python would start a text browser, which would take over this terminal.
    if sys.platform != "linux" or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()
