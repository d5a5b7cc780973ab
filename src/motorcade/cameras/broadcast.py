"""Share a camera among viewers: each picture is taken and packed once, and each viewer gets the newest one.

Pictures come from this computer's camera, or by HTTP, such as those of a car's page: MJPEG, or a JPEG file for each
request.
"""

import asyncio
import http.client
import io
import re
import ssl
import threading
import time
from collections.abc import AsyncGenerator, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import aclosing, closing
from functools import partial
from typing import Any, Protocol
from urllib.parse import urlsplit

from motorcade.errors import CameraError, MotorcadeError, Phrase

WIDTH = 640
HEIGHT = 480
RATE_HZ = 15.0
MOST_VIEWERS = 16
_QUALITY = 70
# Of a camera that is reached by HTTP.
_PATIENCE_S = 2.0
# A viewer asks many times a second; the connection ends when nobody has asked for so long.
_IDLE_S = 1.0
_AGAIN_S = 0.5
_MOST_BYTES = 1 << 22
_CHUNK_BYTES = 1 << 16
_MOST_HEAD_BYTES = 1 << 13
# So many are read, since whoever reads as fast as a camera sends would leave others no time.
_BYTES_A_SECOND = 1 << 24
_LENGTH = re.compile(rb"^content-length[ \t]*:[ \t]*([0-9]{1,9})[ \t]*\r?$", re.IGNORECASE | re.MULTILINE)
_MULTIPART = "multipart/x-mixed-replace"
_JPEG = "image/jpeg"


class CameraDriverError(CameraError):
    """The library that a camera needs isn't installed."""


class Source(Protocol):
    """Where pictures come from. Both methods may block, and are called from one thread at a time."""

    def jpeg(self) -> bytes:
        """The newest picture as a JPEG file. Raises OSError, MotorcadeError."""

    def close(self) -> None:
        """Close the hardware."""


class Camera:
    """A camera that takes pictures only while somebody views it.

    Args:
        source: where its pictures come from.
        rate_hz: the most pictures a second.
        patience_s: how long a viewer waits for a picture before an error.

    Attributes:
        taken: number of pictures that were taken.
        viewers: number of viewers now.
    """

    def __init__(self, source: Source, rate_hz: float = RATE_HZ, patience_s: float = 5.0) -> None:
        self._source = source
        self._rate_hz = rate_hz
        self._patience_s = patience_s
        # A thread of its own: a viewer that leaves doesn't wait for a picture, and only one is taken at a time.
        self._thread = ThreadPoolExecutor(1, "camera")
        self._newest = b""
        self._problem: Exception | None = None
        self._has_new = asyncio.Condition()
        self._taking: asyncio.Task[None] | None = None
        self.taken = 0
        self.viewers = 0

    async def pictures(self, rate_hz: float) -> AsyncGenerator[bytes, None]:
        """Pictures as JPEG files, at most ``rate_hz`` a second; a slow viewer misses some, and never gets an old one.

        Raises:
            MotorcadeError: "too-many-viewers", or the camera gives no picture.
        """
        if self.viewers >= MOST_VIEWERS:
            raise CameraError("too-many-viewers", most=MOST_VIEWERS)
        self.viewers += 1
        if self._taking is None:
            self._taking = asyncio.create_task(self._take())
        seen = self.taken
        clock = asyncio.get_running_loop().time
        try:
            while True:
                due_s = clock() + 1 / rate_hz
                yield await self._after(seen)
                seen = self.taken
                await asyncio.sleep(due_s - clock())
        finally:
            self.viewers -= 1
            if not self.viewers and self._taking:
                self._taking.cancel()
                self._taking = None

    async def snapshot(self) -> bytes:
        """One new picture. Raises MotorcadeError."""
        async with aclosing(self.pictures(self._rate_hz)) as pictures:
            return await anext(pictures)

    async def close(self) -> None:
        """Close the camera when the picture that is being taken is done."""
        if self._taking:
            self._taking.cancel()
        await asyncio.get_running_loop().run_in_executor(self._thread, self._source.close)
        self._thread.shutdown(wait=False)

    async def _after(self, seen: int) -> bytes:
        """The newest picture, as soon as there is one behind number ``seen``."""
        try:
            async with asyncio.timeout(self._patience_s), self._has_new:
                await self._has_new.wait_for(lambda: self.taken != seen)
        except TimeoutError:
            if isinstance(self._problem, MotorcadeError):
                raise self._problem from None
            raise CameraError("no-picture", reason=self._problem or "-") from None
        return self._newest

    async def _take(self) -> None:
        loop = asyncio.get_running_loop()
        due_s = loop.time()
        while True:
            try:
                picture = await loop.run_in_executor(self._thread, self._source.jpeg)
            except (OSError, MotorcadeError) as problem:
                self._problem = problem
            else:
                async with self._has_new:
                    self._newest = picture
                    self._problem = None
                    self.taken += 1
                    self._has_new.notify_all()
            due_s = max(due_s + 1 / self._rate_hz, loop.time())
            await asyncio.sleep(due_s - loop.time())


class PiCamera:
    """The camera of a Raspberry Pi, by picamera2. Raises MotorcadeError where there is none."""

    def __init__(self) -> None:
        try:
            from picamera2 import Picamera2

            self._camera = Picamera2()
            self._camera.configure(self._camera.create_video_configuration(main={"size": (WIDTH, HEIGHT)}))
            self._camera.options["quality"] = _QUALITY
            self._camera.start()
        except ImportError:
            raise CameraDriverError(
                "camera-driver-missing", package="picamera2", command="sudo apt install python3-picamera2"
            ) from None
        except (OSError, RuntimeError, IndexError) as problem:
            raise CameraError("no-camera", reason=problem) from None

    def jpeg(self) -> bytes:
        """The newest picture. Raises OSError."""
        file = io.BytesIO()
        try:
            self._camera.capture_file(file, format="jpeg")
        except RuntimeError as problem:
            raise OSError(str(problem)) from None
        return file.getvalue()

    def close(self) -> None:
        """Close the hardware."""
        self._camera.close()


class OpenCvCamera:
    """The first USB camera, by OpenCV. Raises MotorcadeError where there is none."""

    def __init__(self) -> None:
        try:
            import cv2
        except ImportError:
            raise CameraDriverError(
                "camera-driver-missing", package="OpenCV", command="pip install opencv-python-headless"
            ) from None
        self._cv2: Any = cv2
        self._camera = cv2.VideoCapture(0)
        if not self._camera.isOpened():
            raise CameraError("no-camera", reason="OpenCV: 0")
        for name, value in (("FRAME_WIDTH", WIDTH), ("FRAME_HEIGHT", HEIGHT), ("BUFFERSIZE", 1)):
            self._camera.set(getattr(cv2, f"CAP_PROP_{name}"), value)

    def jpeg(self) -> bytes:
        """The newest picture. Raises OSError."""
        good, picture = self._camera.read()
        if not good:
            raise OSError("OpenCV: no picture")
        _, packed = self._cv2.imencode(".jpg", picture, [self._cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
        return bytes(packed)

    def close(self) -> None:
        """Close the hardware."""
        self._camera.release()


def find_camera() -> Source:
    """This computer's camera: a Raspberry Pi's, else a USB camera. Raises MotorcadeError."""
    try:
        return PiCamera()
    except CameraDriverError:
        return OpenCvCamera()


class Parts:
    """Split a body of multipart/x-mixed-replace into its pictures, however its bytes are cut. Pure.

    ``boundary`` is that of its parts, without the leading hyphens.
    """

    def __init__(self, boundary: str) -> None:
        # Some servers name the boundary with its hyphens.
        self._boundary = b"--" + boundary.removeprefix("--").encode("latin-1")
        self._rest = bytearray()
        # Up to here there is no boundary behind a head without a length.
        self._searched = 0

    def receive_data(self, data: bytes) -> list[bytes]:
        """The pictures that are whole now. Raises ValueError where a part is too long."""
        self._rest += data
        pictures = []
        while (picture := self._next()) is not None:
            pictures.append(picture)
        if len(self._rest) > _MOST_BYTES:
            raise ValueError(f"more than {_MOST_BYTES} bytes without an end")
        return pictures

    def _next(self) -> bytes | None:
        begin = self._rest.find(self._boundary)
        ahead = len(self._boundary) - 1
        # What stands before a boundary is nothing, so the part begins at the beginning of what is kept.
        del self._rest[: begin if begin >= 0 else max(0, len(self._rest) - ahead)]
        head_end = self._rest.find(b"\r\n\r\n", 0, _MOST_HEAD_BYTES)
        if begin < 0 or head_end < 0:
            if len(self._rest) > _MOST_HEAD_BYTES:
                raise ValueError(f"a head of more than {_MOST_HEAD_BYTES} bytes")
            return None
        body = head_end + 4
        found = _LENGTH.search(self._rest, 0, head_end)
        length = None
        if found:
            length = int(found[1])
        if length is not None:
            end = body + length
        else:
            end = self._rest.find(self._boundary, max(body, self._searched))
        if end < body or end > len(self._rest):
            self._searched = len(self._rest) - ahead
            return None
        picture = bytes(self._rest[body:end])
        del self._rest[:end]
        self._searched = 0
        if length is not None:
            return picture
        return picture.removesuffix(b"\r\n")


class WebCamera:
    """Read the pictures at one address while somebody asks for them; redirections aren't followed.

    Args:
        url: http:// or https://, with all that it needs, such as ``token=``.
        trust: the authorities for an https:// address; those that this computer trusts, unless given.
        patience_s: how long `jpeg` waits for a picture before an error.

    Raises:
        MotorcadeError: "not-a-camera-address".
    """

    def __init__(self, url: str, trust: ssl.SSLContext | None = None, patience_s: float = _PATIENCE_S) -> None:
        try:
            parts = urlsplit(url)
            self._host = parts.hostname or ""
            self._port = parts.port
        except ValueError:
            raise CameraError("not-a-camera-address", url=url) from None
        if parts.scheme not in ("http", "https") or not self._host:
            raise CameraError("not-a-camera-address", url=url)
        self._path = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
        # Shown in errors, without the token, which is a secret.
        self._shown = f"{parts.scheme}://{parts.netloc.rpartition('@')[2]}{parts.path}"
        self._connect: Callable[..., http.client.HTTPConnection] = http.client.HTTPConnection
        if parts.scheme == "https":
            self._connect = partial(http.client.HTTPSConnection, context=trust or ssl.create_default_context())
        self._patience_s = patience_s
        self._changed = threading.Condition()
        self._reader: threading.Thread | None = None
        self._asked_s = 0.0
        self._newest = b""
        self._given = self._count = 0
        self._problem: str | Phrase | OSError = ""
        self._closed = False

    def jpeg(self) -> bytes:
        """A picture that was not returned yet. Raises MotorcadeError."""
        with self._changed:
            self._asked_s = time.monotonic()
            if self._reader is None and not self._closed:
                # The picture that was read for former viewers is old.
                self._given = self._count
                self._problem = ""
                self._reader = threading.Thread(target=self._read, name="web camera", daemon=True)
                self._reader.start()
            self._changed.wait_for(lambda: self._count != self._given or bool(self._problem), self._patience_s)
            if self._count == self._given:
                reason = self._problem or Phrase("stays-silent")
                raise CameraError("camera-gives-no-answer", url=self._shown, reason=reason)
            self._given = self._count
            return self._newest

    def close(self) -> None:
        """Close the connection when the next picture comes, or none comes in time."""
        with self._changed:
            self._closed = True

    def _read(self) -> None:
        """Read while somebody asks, so that no old pictures gather in buffers."""
        try:
            for picture in self._pictures():
                if not self._show(picture):
                    return
            problem: str | Phrase | OSError = Phrase("has-ended")
        except OSError as caught:
            problem = caught
        except (http.client.HTTPException, ValueError) as caught:
            problem = str(caught) or type(caught).__name__
        with self._changed:
            self._problem = problem
            self._changed.notify_all()
        time.sleep(_AGAIN_S)
        with self._changed:
            self._reader = None

    def _show(self, picture: bytes) -> bool:
        """Offer a picture. Returns whether somebody still asks for pictures."""
        with self._changed:
            self._newest = picture
            self._count += 1
            self._changed.notify_all()
            is_wanted = not self._closed and time.monotonic() - self._asked_s < _IDLE_S
            if not is_wanted:
                self._reader = None
            return is_wanted

    def _pictures(self) -> Iterator[bytes]:
        """The camera's pictures as they come. Raises OSError, HTTPException, ValueError."""
        with closing(self._connect(self._host, self._port, timeout=self._patience_s)) as connection:
            while True:
                connection.request("GET", self._path)
                answer = connection.getresponse()
                if answer.status != http.HTTPStatus.OK:
                    raise OSError(f"{answer.status} {answer.reason}"[:60])
                kind = answer.headers.get_content_type()
                if kind == _MULTIPART:
                    splitter = Parts(str(answer.headers.get_param("boundary", "")))
                    while data := answer.read1(_CHUNK_BYTES):
                        # Of pictures that come together only the newest counts.
                        yield from splitter.receive_data(data)[-1:]
                        time.sleep(len(data) / _BYTES_A_SECOND)
                    return
                if kind != _JPEG:
                    raise OSError(f"{kind[:40]} is no picture")
                picture = answer.read(_MOST_BYTES + 1)
                if len(picture) > _MOST_BYTES:
                    raise OSError(f"more than {_MOST_BYTES} bytes")
                yield picture
                time.sleep(1 / RATE_HZ)
