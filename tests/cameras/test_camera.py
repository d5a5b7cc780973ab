"""A camera with many viewers: each picture is packed once, and each viewer gets the newest at its own rate."""

import asyncio
import sys
from contextlib import aclosing
from types import SimpleNamespace

import pytest

from motorcade.cameras.broadcast import MOST_VIEWERS, Camera, OpenCvCamera, PiCamera, find_camera
from motorcade.errors import MotorcadeError
from support.mock_clock import mock_clock, pass_time
from support.waiting import until


class Numbered:
    """A source whose pictures are numbers."""

    def __init__(self, broken=False):
        self.taken = 0
        self.broken = broken
        self.closed = False

    def jpeg(self):
        self.taken += 1
        if self.broken:
            raise OSError("the cable is out")
        return str(self.taken).encode()

    def close(self):
        self.closed = True


async def first(count, pictures):
    async with aclosing(pictures):
        return [await anext(pictures) for _ in range(count)]


@mock_clock
async def test_each_picture_is_packed_once_for_all_viewers():
    source = Numbered()
    camera = Camera(source, rate_hz=100)
    seen = await asyncio.gather(*(first(5, camera.pictures(1000)) for _ in range(8)))
    assert seen == [seen[0]] * 8
    assert source.taken <= int(seen[0][-1]) + 2


@mock_clock
async def test_a_slow_viewer_gets_the_newest_picture():
    source = Numbered()
    camera = Camera(source, rate_hz=500)
    async with aclosing(camera.pictures(1000)) as pictures:
        await anext(pictures)
        await until(lambda: source.taken >= 50)
        assert int(await anext(pictures)) >= 49


@mock_clock
async def test_each_viewer_has_its_own_rate():
    clock = asyncio.get_running_loop().time
    camera = Camera(Numbered(), rate_hz=500)
    begin_s = clock()

    async def duration_s(pictures):
        await first(5, pictures)
        return clock() - begin_s

    slow_s, quick_s = await asyncio.gather(duration_s(camera.pictures(20)), duration_s(camera.pictures(1000)))
    assert slow_s == pytest.approx(4 / 20, abs=0.01)
    assert quick_s < slow_s


@mock_clock
async def test_no_picture_is_taken_without_a_viewer():
    source = Numbered()
    camera = Camera(source, rate_hz=1000)
    await first(3, camera.pictures(1000))
    taken = source.taken
    await pass_time(0.05)
    assert source.taken <= taken + 1
    assert camera.viewers == 0
    assert int(await camera.snapshot()) > taken
    await camera.close()
    assert source.closed


@mock_clock
async def test_a_viewer_too_many_is_refused():
    camera = Camera(Numbered(), rate_hz=100)
    watching = [camera.pictures(1) for _ in range(MOST_VIEWERS)]
    await asyncio.gather(*(anext(each) for each in watching))
    with pytest.raises(MotorcadeError) as refused:
        await camera.snapshot()
    assert refused.value.code == "too-many-viewers"
    await watching[0].aclose()
    assert await camera.snapshot()
    for each in watching:
        await each.aclose()


@mock_clock
async def test_a_camera_that_fails_gives_the_reason_and_later_pictures_again():
    source = Numbered(broken=True)
    camera = Camera(source, rate_hz=1000, patience_s=1)
    with pytest.raises(MotorcadeError, match="the cable is out"):
        await camera.snapshot()
    source.broken = False
    assert await camera.snapshot()


# Hardware, by stand-ins for the packages that read it.


class FakePicamera2:
    fails = None

    def __init__(self):
        if self.fails:
            raise self.fails
        self.options = {}
        self.started = False

    def create_video_configuration(self, main):
        return main

    def configure(self, main):
        self.size = main["size"]

    def start(self):
        self.started = True

    def capture_file(self, file, format):  # noqa: A002  # picamera2's own name
        assert self.started
        file.write(f"{format} {self.size}".encode())

    def close(self):
        self.started = False


def fake_cv2(opens=True, reads=True):
    class VideoCapture:
        def __init__(self, number):
            self.number = number
            self.wishes = {}

        def isOpened(self):  # noqa: N802  # OpenCV's own name
            return opens

        def set(self, name, value):
            self.wishes[name] = value

        def read(self):
            return reads, f"picture of {self.number}"

        def release(self):
            pass

    names = {"CAP_PROP_FRAME_WIDTH": 3, "CAP_PROP_FRAME_HEIGHT": 4, "CAP_PROP_BUFFERSIZE": 38}
    return SimpleNamespace(
        VideoCapture=VideoCapture,
        IMWRITE_JPEG_QUALITY=1,
        imencode=lambda ending, picture, options: (True, f"{ending} {picture}".encode()),
        **names,
    )


def test_a_raspberry_pis_camera_is_read_by_picamera2(monkeypatch):
    monkeypatch.setitem(sys.modules, "picamera2", SimpleNamespace(Picamera2=FakePicamera2))
    camera = find_camera()
    assert isinstance(camera, PiCamera)
    assert camera.jpeg() == b"jpeg (640, 480)"
    camera.close()


def test_a_pi_whose_camera_does_not_answer_says_so(monkeypatch):
    class Dead(FakePicamera2):
        fails = IndexError("list index out of range")

    monkeypatch.setitem(sys.modules, "picamera2", SimpleNamespace(Picamera2=Dead))
    with pytest.raises(MotorcadeError, match="cable"):
        find_camera()


def test_another_computers_camera_is_read_by_opencv(monkeypatch):
    monkeypatch.setitem(sys.modules, "picamera2", None)
    monkeypatch.setitem(sys.modules, "cv2", fake_cv2())
    camera = find_camera()
    assert isinstance(camera, OpenCvCamera)
    assert camera.jpeg() == b".jpg picture of 0"
    camera.close()


@pytest.mark.parametrize("cv2", [fake_cv2(opens=False), None])
def test_without_a_camera_the_sentence_says_what_to_do(monkeypatch, cv2):
    monkeypatch.setitem(sys.modules, "picamera2", None)
    monkeypatch.setitem(sys.modules, "cv2", cv2)
    with pytest.raises(MotorcadeError, match="cable" if cv2 else "pip install"):
        find_camera()


def test_a_camera_that_was_pulled_out_says_so(monkeypatch):
    monkeypatch.setitem(sys.modules, "cv2", fake_cv2(reads=False))
    with pytest.raises(OSError, match="no picture"):
        OpenCvCamera().jpeg()
