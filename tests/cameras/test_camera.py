"""A camera with many viewers: each picture is packed once, and each viewer gets the newest at its own rate."""

import asyncio
import sys
from contextlib import aclosing
from unittest.mock import Mock

import pytest

from motorcade.cameras.broadcast import MOST_VIEWERS, Camera, OpenCvCamera, PiCamera, find_camera
from motorcade.errors import MotorcadeError
from support.mock_clock import mock_clock, pass_time
from support.waiting import until


class NumberedCamera:
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
    source = NumberedCamera()
    camera = Camera(source, rate_hz=100)
    seen = await asyncio.gather(*(first(5, camera.pictures(1000)) for _ in range(8)))
    assert seen == [seen[0]] * 8
    assert source.taken <= int(seen[0][-1]) + 2


@mock_clock
async def test_a_slow_viewer_gets_the_newest_picture():
    source = NumberedCamera()
    camera = Camera(source, rate_hz=500)
    async with aclosing(camera.pictures(1000)) as pictures:
        await anext(pictures)
        await until(lambda: source.taken >= 50)
        assert int(await anext(pictures)) >= 49


@mock_clock
async def test_each_viewer_has_its_own_rate():
    clock = asyncio.get_running_loop().time
    camera = Camera(NumberedCamera(), rate_hz=500)
    begin_s = clock()

    async def duration_s(pictures):
        await first(5, pictures)
        return clock() - begin_s

    slow_s, quick_s = await asyncio.gather(duration_s(camera.pictures(20)), duration_s(camera.pictures(1000)))
    assert slow_s == pytest.approx(4 / 20, abs=0.01)
    assert quick_s < slow_s


@mock_clock
async def test_no_picture_is_taken_without_a_viewer():
    source = NumberedCamera()
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
    camera = Camera(NumberedCamera(), rate_hz=100)
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
    source = NumberedCamera(broken=True)
    camera = Camera(source, rate_hz=1000, patience_s=1)
    with pytest.raises(MotorcadeError, match="the cable is out"):
        await camera.snapshot()
    source.broken = False
    assert await camera.snapshot()


# Hardware, by stand-ins for the packages that read it.


def fake_picamera2(problem=None):
    module = Mock()
    camera = module.Picamera2.return_value
    camera.options = {}
    camera.create_video_configuration.side_effect = lambda main: main["size"]
    camera.start.side_effect = problem
    camera.capture_file.side_effect = lambda file, **options: file.write(
        f"{options} {camera.configure.call_args}".encode()
    )
    return module


def fake_cv2(opens=True, reads=True):
    module = Mock()
    module.VideoCapture.return_value.isOpened.return_value = opens
    module.VideoCapture.return_value.read.return_value = (reads, "picture")
    module.imencode.side_effect = lambda ending, picture, options: (True, f"{ending} {picture}".encode())
    return module


def test_a_raspberry_pis_camera_is_read_by_picamera2(monkeypatch):
    monkeypatch.setitem(sys.modules, "picamera2", fake_picamera2())
    camera = find_camera()
    assert isinstance(camera, PiCamera)
    assert camera.jpeg() == b"{'format': 'jpeg'} call((640, 480))"
    camera.close()


def test_a_pi_whose_camera_does_not_answer_says_so(monkeypatch):
    monkeypatch.setitem(sys.modules, "picamera2", fake_picamera2(IndexError("list index out of range")))
    with pytest.raises(MotorcadeError, match="cable"):
        find_camera()


def test_another_computers_camera_is_read_by_opencv(monkeypatch):
    monkeypatch.setitem(sys.modules, "picamera2", None)
    monkeypatch.setitem(sys.modules, "cv2", fake_cv2())
    camera = find_camera()
    assert isinstance(camera, OpenCvCamera)
    assert camera.jpeg() == b".jpg picture"
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
