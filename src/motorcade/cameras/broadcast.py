"""A camera that many watch: one picture is taken and packed once for all, and each gets the newest at its own pace."""

import asyncio
import io
import time
from collections.abc import AsyncGenerator, Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import aclosing
from typing import Any, Protocol

from motorcade.cameras.camera_failures import CameraError

WIDTH, HEIGHT = 640, 480
RATE_HZ = 15.0
MOST_VIEWERS = 16
_QUALITY = 70


class Source(Protocol):
    """Where pictures come from; both methods may wait, and are called from one thread at a time."""

    def jpeg(self) -> bytes:
        """The newest picture as a JPEG file. Raises OSError."""

    def close(self) -> None:
        """Give the hardware up."""


class Camera:
    """A camera; it takes pictures only while somebody watches.

    Args:
        source: where they come from.
        rate_hz: so many a second at most.
        clock: seconds that only grow.
        patience_s: who asks for a picture and gets none for so long is told so.

    Attributes:
        taken: how many pictures were taken.
        viewers: how many watch.
    """

    def __init__(
        self,
        source: Source,
        rate_hz: float = RATE_HZ,
        clock: Callable[[], float] = time.monotonic,
        patience_s: float = 5.0,
    ) -> None:
        self._source = source
        self._rate_hz = rate_hz
        self._clock = clock
        self._patience_s = patience_s
        # One of its own: who leaves while a picture is taken doesn't wait for it, and the next one is taken after it.
        self._thread = ThreadPoolExecutor(1, "camera")
        self._newest = b""
        self._problem: OSError | None = None
        self._came = asyncio.Condition()
        self._taking: asyncio.Task[None] | None = None
        self.taken = 0
        self.viewers = 0

    async def pictures(self, rate_hz: float) -> AsyncGenerator[bytes, None]:
        """Pictures as JPEG files, up to so many a second; who is slow misses some, and never sees an old one.

        Raises:
            CameraError: too many watch already, or the camera gives no picture.
        """
        if self.viewers >= MOST_VIEWERS:
            raise CameraError("too-many-viewers", most=MOST_VIEWERS)
        self.viewers += 1
        if self._taking is None:
            self._taking = asyncio.create_task(self._take())
        seen = self.taken
        try:
            while True:
                due_s = self._clock() + 1 / rate_hz
                yield await self._after(seen)
                seen = self.taken
                await asyncio.sleep(due_s - self._clock())
        finally:
            self.viewers -= 1
            if not self.viewers and self._taking:
                self._taking.cancel()
                self._taking = None

    async def snapshot(self) -> bytes:
        """One new picture. Raises CameraError."""
        async with aclosing(self.pictures(self._rate_hz)) as pictures:
            return await anext(pictures)

    async def close(self) -> None:
        """Give the camera up, once it has taken the picture that it is at."""
        if self._taking:
            self._taking.cancel()
        await asyncio.get_running_loop().run_in_executor(self._thread, self._source.close)
        self._thread.shutdown(wait=False)

    async def _after(self, seen: int) -> bytes:
        """The newest picture as soon as there is one that wasn't seen."""
        try:
            async with asyncio.timeout(self._patience_s), self._came:
                await self._came.wait_for(lambda: self.taken != seen)
        except TimeoutError:
            if isinstance(self._problem, CameraError):
                raise self._problem from None
            raise CameraError("no-picture", reason=str(self._problem or "-")) from None
        return self._newest

    async def _take(self) -> None:
        due_s = self._clock()
        while True:
            try:
                picture = await asyncio.get_running_loop().run_in_executor(self._thread, self._source.jpeg)
            except OSError as problem:
                self._problem = problem
            else:
                async with self._came:
                    self._newest, self._problem = picture, None
                    self.taken += 1
                    self._came.notify_all()
            due_s = max(due_s + 1 / self._rate_hz, self._clock())
            await asyncio.sleep(due_s - self._clock())


class PiCamera:
    """The camera of a Raspberry Pi, by picamera2. Raises CameraError where there is none."""

    def __init__(self) -> None:
        try:
            from picamera2 import Picamera2

            self._camera = Picamera2()
            self._camera.configure(self._camera.create_video_configuration(main={"size": (WIDTH, HEIGHT)}))
            self._camera.options["quality"] = _QUALITY
            self._camera.start()
        except ImportError:
            raise CameraError("not-installed", package="picamera2", how="sudo apt install python3-picamera2") from None
        except (OSError, RuntimeError, IndexError) as problem:
            raise CameraError("no-camera", reason=str(problem)) from None

    def jpeg(self) -> bytes:
        """The newest picture. Raises OSError."""
        file = io.BytesIO()
        try:
            self._camera.capture_file(file, format="jpeg")
        except RuntimeError as problem:
            raise OSError(str(problem)) from None
        return file.getvalue()

    def close(self) -> None:
        """Give the hardware up."""
        self._camera.close()


class OpenCvCamera:
    """A USB camera, by OpenCV. Raises CameraError where there is none.

    Args:
        number: which one, counted from 0.
    """

    def __init__(self, number: int = 0) -> None:
        try:
            import cv2
        except ImportError:
            raise CameraError("not-installed", package="OpenCV", how="pip install opencv-python-headless") from None
        self._cv2: Any = cv2
        self._camera = cv2.VideoCapture(number)
        if not self._camera.isOpened():
            raise CameraError("no-camera", reason=f"OpenCV: {number}")
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
        """Give the hardware up."""
        self._camera.release()


def find_camera() -> Source:
    """The camera of this computer: a Raspberry Pi's, else a USB camera. Raises CameraError where there is neither."""
    try:
        return PiCamera()
    except CameraError as problem:
        if problem.code != "not-installed":
            raise
    return OpenCvCamera()
