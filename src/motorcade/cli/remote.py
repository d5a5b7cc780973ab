"""What `motorcade drive serve` needs for the car's own page: its address, who may open it, and the camera."""

import secrets
import socket
import ssl
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from motorcade.cli.options import needs_extra

if TYPE_CHECKING:
    from motorcade.cameras.broadcast import Source
    from motorcade.drive.session import CarControl


class Looks(StrEnum):
    """Where a real car's pictures come from."""

    NONE = "none"
    AUTO = "auto"
    PICAMERA2 = "picamera2"
    OPENCV = "opencv"


class Web(NamedTuple):
    """The page's door.

    Attributes:
        listener: where it listens.
        host: as it was asked for.
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


def eye(looks: Looks) -> "Source | None":
    """A real car's camera. Raises MotorcadeError where the one that was asked for isn't there."""
    from motorcade.cameras import broadcast as camera

    if looks == Looks.NONE:
        return None
    makes = {Looks.AUTO: camera.find_camera, Looks.PICAMERA2: camera.PiCamera, Looks.OPENCV: camera.OpenCvCamera}
    return makes[looks]()


def load_page() -> None:
    """Import what the page needs, as long as no car waits for it. Raises UsageError where an extra isn't installed."""
    with needs_extra("car-page", "drive"):
        import motorcade.server.remote.app
        import motorcade.server.running  # noqa: F401


@asynccontextmanager
async def page_served(drive: "CarControl", web: Web) -> AsyncIterator[str]:
    """Serve the car's page while the block runs; gives its whole address. `load_page` comes first."""
    from motorcade.cameras.broadcast import Camera
    from motorcade.drive.listener import is_loopback
    from motorcade.server.remote.app import make_remote
    from motorcade.server.remote.fleet import SingleCar
    from motorcade.server.request_filter import ServerSettings
    from motorcade.server.running import names_of, served, url_of

    names = names_of(web.listener, web.host)
    port = web.listener.getsockname()[1]
    token = None if is_loopback(web.listener) else secrets.token_urlsafe(24)
    settings = ServerSettings(host=web.host, port=port, names=frozenset(names), token=token)
    camera = Camera(web.source) if web.source else None
    try:
        async with served(make_remote(settings, SingleCar(drive, camera)), settings, web.listener, web.tls):
            yield url_of(names[0], port, token, "/drive", "https" if web.tls else "http")
    finally:
        if camera:
            await camera.close()
