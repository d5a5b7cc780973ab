"""The command about the page: studio.

It imports what it needs when it runs, so that the other commands start at once.
"""

import os
import secrets
import socket
import sys
import threading
import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from motorcade.cli.language import translated
from motorcade.cli.options import Json, needs_extra, print_json
from motorcade.cli.remote import Cameras, DriverKeys, named_cars
from motorcade.errors import MotorcadeError


def add_to(app: typer.Typer) -> None:
    """Register the command."""
    app.command("studio")(studio_command)


def studio_command(
    port: Annotated[int, typer.Option(min=0, max=65535, help="Where it listens; 0 takes a free one.")] = 7700,
    host: Annotated[
        str, typer.Option(help="The address it listens at. Any but this computer's own asks others for a token.")
    ] = "127.0.0.1",
    library: Annotated[Path | None, typer.Option(file_okay=False, help="The folder that projects are kept in.")] = None,
    car: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=HOST[:PORT]",
            help="A real car that its remote drives beside the simulated ones, as `motorcade drive remote` takes them.",
        ),
    ] = None,
    keys: DriverKeys = None,
    camera: Cameras = None,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Don't open the page.")] = False,
    as_json: Json = False,
) -> None:
    """Program with blocks in the browser, watch the cars do it, and upload it."""
    with needs_extra("studio", "studio"):
        from motorcade.drive.listener import is_loopback
        from motorcade.server.running import names_of, serve_alone, url_of
        from motorcade.server.studio.app import Settings, make_app
    named = named_cars(car or (), camera or (), keys)
    folder = library or Path(typer.get_app_dir("motorcade")) / "projects"
    with _listen(host, port) as listener:
        names = names_of(listener, host)
        token = None if is_loopback(listener) else secrets.token_urlsafe(24)
        real_port = listener.getsockname()[1]
        url = url_of(names[0], real_port, token)
        settings = Settings(
            library=folder, host=host, port=real_port, names=frozenset(names), token=token, **named._asdict()
        )

        def ready() -> None:
            threading.Thread(target=_compile_simulator, daemon=True).start()
            if as_json:
                print_json({"url": url, "library": str(folder)})
            else:
                print(translated("studio-is-ready", url=url, folder=folder), flush=True)
            if not no_browser:
                open_browser(url)

        serve_alone(make_app(settings), settings, listener, ready)


def _listen(host: str, port: int) -> socket.socket:
    """A socket that listens at the address; port 0 takes a free one. Raises MotorcadeError."""
    from motorcade.drive.listener import bind
    from motorcade.server.running import url_of

    try:
        return bind(host, port, "studio")
    except MotorcadeError as problem:
        if problem.code != "port-taken":
            raise
        raise MotorcadeError("studio-port-taken", port=port, url=url_of(host, port)) from None


def open_browser(url: str) -> None:
    """Show ``url`` in the browser, if there is one with a window; doesn't wait for it."""
    # Without a display Python would start a text browser, which would take over this terminal.
    if sys.platform != "linux" or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()


def _compile_simulator() -> None:
    """Compile the simulator after an install, so that the first world needn't wait for it."""
    from motorcade.engine.world import World, warm_up
    from motorcade.mats import formation, open_table

    warm_up(World(open_table(formation(1)), [bytes(4)], threads=1))
