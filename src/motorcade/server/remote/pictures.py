"""Pictures of a car's camera over HTTP: one, or one after the other in one answer, as browsers show them (MJPEG)."""

from collections.abc import AsyncGenerator, AsyncIterator
from contextlib import aclosing

from starlette.requests import Request
from starlette.responses import Response, StreamingResponse

from motorcade.cameras.broadcast import RATE_HZ, Camera
from motorcade.errors import MotorcadeError
from motorcade.server.errors import ServerError
from motorcade.server.remote.errors import RemoteError, said

_BOUNDARY = "motorcade-picture"
_MOST_HZ = 30.0


async def snapshot(camera: Camera | None) -> Response:
    """One new picture. Raises RemoteError."""
    try:
        return Response(await _given(camera).snapshot(), media_type="image/jpeg")
    except MotorcadeError as problem:
        raise said(problem) from None


async def stream(request: Request, camera: Camera | None) -> Response:
    """Pictures for as long as somebody looks, ``rate`` a second at most. Raises ServerError."""
    pictures = _given(camera).pictures(_rate(request.query_params.get("rate", "")))
    try:
        # The first one before the answer, so that a camera that fails is an error and no broken picture.
        first = await anext(pictures)
    except MotorcadeError as problem:
        raise said(problem) from None
    return StreamingResponse(_parts(first, pictures), media_type=f"multipart/x-mixed-replace; boundary={_BOUNDARY}")


async def _parts(first: bytes, pictures: AsyncGenerator[bytes, None]) -> AsyncIterator[bytes]:
    async with aclosing(pictures):
        yield _part(first)
        try:
            async for picture in pictures:
                yield _part(picture)
        except MotorcadeError:
            # The headers are out: all that is left is to end.
            return


def _part(picture: bytes) -> bytes:
    head = f"--{_BOUNDARY}\r\nContent-Type: image/jpeg\r\nContent-Length: {len(picture)}\r\n\r\n"
    return head.encode() + picture + b"\r\n"


def _given(camera: Camera | None) -> Camera:
    if camera is None:
        raise RemoteError("no-camera-here", 404)
    return camera


def _rate(text: str) -> float:
    try:
        rate_hz = float(text or RATE_HZ)
    except ValueError:
        rate_hz = 0.0
    if not 0.1 <= rate_hz <= _MOST_HZ:
        raise ServerError(
            "bad-request", reason=f"rate is {text[:20]!r}; allowed: 0.1 to {_MOST_HZ:g} pictures a second"
        )
    return rate_hz
