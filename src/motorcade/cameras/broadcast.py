"""Share a camera among viewers: each picture is taken and packed once, and each viewer gets the newest one."""

import asyncio
import io
import time
from collections.abc import AsyncGenerator, Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import aclosing
from typing import Any, Protocol

from motorcade.errors import MotorcadeError

WIDTH, HEIGHT = 640, 480
RATE_HZ = 15.0
MOST_VIEWERS = 16
_QUALITY = 70


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
        clock: gives the time in seconds, which never goes back.
        patience_s: how long a viewer waits for a picture before an error.

    Attributes:
        taken: number of pictures that were taken.
        viewers: number of viewers now.
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
            raise MotorcadeError("too-many-viewers", most=MOST_VIEWERS)
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
            raise MotorcadeError("no-picture", reason=self._problem or "-") from None
        return self._newest

    async def _take(self) -> None:
        due_s = self._clock()
        while True:
            try:
                picture = await asyncio.get_running_loop().run_in_executor(self._thread, self._source.jpeg)
            except (OSError, MotorcadeError) as problem:
                self._problem = problem
            else:
                async with self._has_new:
                    self._newest, self._problem = picture, None
                    self.taken += 1
                    self._has_new.notify_all()
            due_s = max(due_s + 1 / self._rate_hz, self._clock())
            await asyncio.sleep(due_s - self._clock())


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
            raise MotorcadeError(
                "camera-driver-missing", package="picamera2", command="sudo apt install python3-picamera2"
            ) from None
        except (OSError, RuntimeError, IndexError) as problem:
            raise MotorcadeError("no-camera", reason=problem) from None

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
            raise MotorcadeError(
                "camera-driver-missing", package="OpenCV", command="pip install opencv-python-headless"
            ) from None
        self._cv2: Any = cv2
        self._camera = cv2.VideoCapture(0)
        if not self._camera.isOpened():
            raise MotorcadeError("no-camera", reason="OpenCV: 0")
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
    except MotorcadeError as problem:
        if problem.code != "camera-driver-missing":
            raise
    return OpenCvCamera()
