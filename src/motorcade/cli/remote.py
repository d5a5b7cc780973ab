"""The pages that drive cars: a served car's own page, and `drive remote` for cars that are served elsewhere.

They import what they need when they run, so that the other commands start quickly.
"""

import secrets
import socket
import ssl
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from motorcade.cli.driving import address_of
from motorcade.cli.language import translated
from motorcade.cli.options import Json, needs_extra, print_json, print_text
from motorcade.errors import MotorcadeError

if TYPE_CHECKING:
    from motorcade.cameras.broadcast import Source
    from motorcade.drive.session import CarControl
    from motorcade.server.remote.fleet import RemoteCar


class CameraName(StrEnum):
    """Where a real car's pictures come from."""

    NONE = "none"
    AUTO = "auto"
    PICAMERA2 = "picamera2"
    OPENCV = "opencv"


class PageOptions(NamedTuple):
    """Where and how the page of a car is served.

    Attributes:
        listener: where it listens.
        host: the address that the user gave.
        tls: for HTTPS; None for HTTP.
        source: where its pictures come from, if it has a camera.
    """

    listener: socket.socket
    host: str
    tls: ssl.SSLContext | None
    source: "Source | None"


def https(keys: Path | None) -> ssl.SSLContext | None:
    """HTTPS with a car's keys file; None without one. Raises KeysError."""
    if keys is None:
        return None
    from motorcade.drive.tls.keys import https_context

    return https_context(keys)


def open_camera(name: CameraName) -> "Source | None":
    """A real car's camera. Raises MotorcadeError where the requested camera isn't there."""
    from motorcade.cameras.broadcast import OpenCvCamera, PiCamera, find_camera

    if name == CameraName.NONE:
        return None
    return {CameraName.AUTO: find_camera, CameraName.PICAMERA2: PiCamera, CameraName.OPENCV: OpenCvCamera}[name]()


def load_page() -> None:
    """Import what the page needs, as long as no car waits for it. Raises UsageError where an extra isn't installed."""
    with needs_extra("car-page", "drive"):
        import motorcade.server.remote.app
        import motorcade.server.running  # noqa: F401


@asynccontextmanager
async def serving_page(control: "CarControl", options: PageOptions) -> AsyncIterator[str]:
    """Serve the car's page while the block runs; gives its whole address. `load_page` comes first."""
    from motorcade.cameras.broadcast import Camera
    from motorcade.drive.listener import is_loopback
    from motorcade.server.remote.app import make_remote
    from motorcade.server.remote.fleet import SingleCar
    from motorcade.server.request_filter import ServerSettings
    from motorcade.server.running import names_of, served, url_of

    names = names_of(options.listener, options.host)
    port = options.listener.getsockname()[1]
    token = None if is_loopback(options.listener) else secrets.token_urlsafe(24)
    settings = ServerSettings(host=options.host, port=port, names=frozenset(names), token=token)
    camera = Camera(options.source) if options.source else None
    try:
        async with served(make_remote(settings, SingleCar(control, camera)), settings, options.listener, options.tls):
            yield url_of(names[0], port, token, "/drive", "https" if options.tls else "http")
    finally:
        if camera:
            await camera.close()


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


class NamedCars(NamedTuple):
    """Cars by address, as `motorcade.server.remote.fleet.RemoteCars` takes them."""

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
        from motorcade.server.remote.fleet import RemoteCars
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
        car_names = [car.name for car in named.cars]

        def ready() -> None:
            if as_json:
                print_json({"url": url, "cars": car_names})
            else:
                print_text(translated("remote-is-ready", cars=", ".join(car_names), url=url) + "\n")

        serve_alone(make_remote(settings, RemoteCars(*named)), settings, listener, ready, tls)


def named_cars(texts: Sequence[str], cameras: Sequence[str], keys: Path | None) -> NamedCars:
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
    return NamedCars(cars, client_context(keys) if keys else None, trust)


def _car(text: str, urls: dict[str, str]) -> "RemoteCar":
    from motorcade.server.remote.fleet import RemoteCar, is_name

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
