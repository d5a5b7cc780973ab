"""Infrared out by the kernel's device, which is a pipe here: what is written to it, and how long that takes."""

import os
import struct
import sys
from pathlib import Path

import pytest

from motorcade.boards.linux.infrared import LircSender, open_sender
from motorcade.errors import MotorcadeError
from motorcade.words.infrared import frame_durations_us
from support.waiting import wait_until

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="LIRC is Linux's")
# linux/lirc.h, and the features of a pwm-ir-tx and of a receiver.
GET_FEATURES, SET_SEND_CARRIER = 0x80046900, 0x40046913
SENDS, ONLY_RECEIVES = 0x00000102, 0x00040000


@pytest.fixture
def pipe():
    ends = list(os.pipe())
    yield ends
    for end in ends:
        if end is not None:
            os.close(end)


@pytest.fixture
def sender(pipe):
    out = LircSender(pipe[1], 560, lambda: 7.5)
    pipe[1] = None
    yield out
    out.close()


@pytest.mark.parametrize("frame", [0, 0xFFFFFFFF, 0xE4800001])
def test_a_frame_is_one_write_of_its_marks_and_spaces(sender, pipe, frame):
    sender.send(frame)
    wait_until(lambda: not sender.is_sending())
    data = os.read(pipe[0], 4096)
    assert list(struct.unpack("=67I", data)) == frame_durations_us(frame)
    assert sender.ended_s == 7.5


def test_a_car_is_sending_until_the_kernel_has_sent(pipe):
    # A full pipe stands for a kernel that is still sending.
    os.set_blocking(pipe[1], False)
    filled = 0
    try:
        while True:
            filled += os.write(pipe[1], bytes(4096))
    except BlockingIOError:
        os.set_blocking(pipe[1], True)
    sender = LircSender(pipe[1], 560, lambda: 0.0)
    pipe[1] = None
    assert not sender.is_sending()
    sender.send(0)
    assert sender.is_sending()
    while filled > 0:
        filled -= len(os.read(pipe[0], min(filled, 4096)))
    wait_until(lambda: not sender.is_sending())
    sender.close()


def test_a_failing_device_raises_at_the_next_frame(pipe):
    sender = LircSender(os.open(os.devnull, os.O_RDONLY), 560, lambda: 0.0)
    sender.send(0)
    wait_until(lambda: not sender.is_sending())
    with pytest.raises(MotorcadeError, match="infrared sender fails"):
        sender.send(0)
    sender.close()


def name_of(device):
    return Path(f"/proc/self/fd/{device}").readlink().name


def devices(folder, **features):
    """Make files that stand for LIRC devices; return the ioctl that answers for them, and its calls."""
    for name in features:
        (folder / name).touch()
    told = []

    def control(device, request, argument):
        if request == GET_FEATURES:
            name = name_of(device)
            return features[name].to_bytes(4, sys.byteorder)
        told.append((request, argument))
        return argument

    return control, told


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_the_device_that_sends_is_found_among_others_and_set_to_38_khz(tmp_path):
    control, told = devices(tmp_path, lirc0=ONLY_RECEIVES, lirc1=SENDS)
    device = open_sender(tmp_path, control)
    assert name_of(device) == "lirc1"
    assert told == [(SET_SEND_CARRIER, struct.pack("=I", 38_000))]
    os.close(device)


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_without_a_sending_device_the_sentence_says_how_to_get_one(tmp_path):
    control, told = devices(tmp_path, lirc0=ONLY_RECEIVES)
    with pytest.raises(MotorcadeError, match="dtoverlay=pwm-ir-tx"):
        open_sender(tmp_path, control)
    assert told == []
