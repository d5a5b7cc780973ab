"""Cars that are served elsewhere: drive remote, and how the studio is told of them.

It imports what it needs when it runs, so that the other commands start at once.
"""

import secrets
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from motorcade.cli.driving import address_of
from motorcade.cli.options import Json, needs_extra, print_json, print_text
from motorcade.cli.remote import https
from motorcade.errors import MotorcadeError

if TYPE_CHECKING:
    import ssl

    from motorcade.server.remote.remote_cars import RemoteCar

_METAVAR = "NAME=HOST[:PORT]"
_HELP = "such as ada=192.168.1.20; its telemetry is at the port behind PORT, or :PORT/TELEMETRY."

Cameras = Annotated[
    list[str] | None,
    typer.Option(
        "--camera",
        metavar="NAME=URL",
        help="A car's pictures, such as ada=https://192.168.1.20:7700/camera?token=…, of its own page or of any camera "
        "that gives MJPEG or JPEG.",
    ),
]
DriverKeys = Annotated[
    Path | None,
    typer.Option(
        dir_okay=False,
        help="Your keys file, driver-….pem, of `motorcade drive keys`, where the cars want one. NAME is then "
        "the name in the car's keys.",
    ),
]


class Named(NamedTuple):
    """Cars by address, as `motorcade.server.remote.remote_cars.RemoteCars` takes them."""

    cars: "tuple[RemoteCar, ...]"
    keys: "ssl.SSLContext | None"
    trust: "ssl.SSLContext | None"


def add_to(app: typer.Typer) -> None:
    """Register the command in the group `drive`."""
    app.command("remote")(remote_command)


def remote_command(
    cars: Annotated[list[str], typer.Argument(metavar=f"{_METAVAR}…", help=f"The cars, {_HELP}")],
    keys: DriverKeys = None,
    camera: Cameras = None,
    host: Annotated[
        str, typer.Option(help="The address that the page is at. Any but this computer's own asks others for a token.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Where the page is; 0 takes a free one.")] = 7701,
    page_keys: Annotated[
        Path | None,
        typer.Option(
            "--https",
            dir_okay=False,
            help="Serve the page by HTTPS, with this computer's keys: `motorcade drive keys --car NAME@ADDRESS`.",
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Drive cars that are served elsewhere, one or several at once, in a browser."""
    with needs_extra("remote", "drive"):
        from motorcade.drive.listener import is_loopback
        from motorcade.server.remote.app import make_remote
        from motorcade.server.remote.remote_cars import RemoteCars
        from motorcade.server.request_filter import ServerSettings
        from motorcade.server.running import names_of, serve_alone, url_of
    from motorcade.drive.listener import bind

    named = named_cars(cars, camera or (), keys)
    tls = https(page_keys)
    with bind(host, port, "remote") as listener:
        names, real_port = names_of(listener, host), listener.getsockname()[1]
        token = None if is_loopback(listener) else secrets.token_urlsafe(24)
        settings = ServerSettings(host=host, port=real_port, names=frozenset(names), token=token)
        url = url_of(names[0], real_port, token, "/drive", "https" if tls else "http")
        called = [car.name for car in named.cars]

        def ready() -> None:
            if as_json:
                print_json({"url": url, "cars": called})
            else:
                print_text(f"The remote of {', '.join(called)} is {url} Ctrl-C ends.\n")

        serve_alone(make_remote(settings, RemoteCars(*named)), settings, listener, ready, tls)


def named_cars(texts: Sequence[str], cameras: Sequence[str], keys: Path | None) -> Named:
    """The cars that the command line names. Raises MotorcadeError."""
    from motorcade.cameras.web import WebCamera
    from motorcade.drive.tls.keys import client_context, visitor_context

    urls = dict(_pair(each, "not-name-and-url") for each in cameras)
    trust = visitor_context(keys) if urls else None
    cars = tuple(_car(text, urls) for text in texts)
    names = [car.name for car in cars]
    for name in names:
        if names.count(name) > 1:
            raise MotorcadeError("cars-of-one-name", name=name)
    for name, url in urls.items():
        if name not in names:
            raise MotorcadeError("camera-without-car", name=name)
        try:
            WebCamera(url, trust)
        except MotorcadeError as problem:
            raise MotorcadeError("camera-of-car", car=name, reason=problem) from None
    return Named(cars, client_context(keys) if keys else None, trust)


def _car(text: str, urls: dict[str, str]) -> "RemoteCar":
    from motorcade.server.remote.remote_cars import RemoteCar, is_name

    name, where = _pair(text, "not-name-and-host", form=_METAVAR)
    if not is_name(name):
        raise MotorcadeError("not-a-car-name", name=name)
    where, slash, telemetry = where.partition("/")
    host, port = address_of(where)
    if slash and not (telemetry.isascii() and telemetry.isdigit() and 0 < int(telemetry) < 65536):
        raise MotorcadeError("not-a-telemetry-port", text=telemetry, name=name)
    return RemoteCar(name, host, port, int(telemetry) if slash else None, urls.get(name))


def _pair(text: str, code: str, **details: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals or not name or not value:
        raise MotorcadeError(code, text=text, **details)
    return name, value
