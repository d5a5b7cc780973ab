"""Which ports a computer has, and which of them a car is likely at."""

import os
import sys

import pytest
from serial.tools import list_ports
from serial.tools.list_ports_common import ListPortInfo

from motorcade.errors import MotorcadeError
from motorcade.upload.serial_port import BARE, BOARD, OTHER, USB, SeveralPortsError, group_of, likely_port, ports


def described(device, vid=None, pid=None, description="n/a", hwid="n/a"):
    """A port as pyserial tells of it."""
    port = ListPortInfo(device)
    port.vid, port.pid, port.description, port.hwid = vid, pid, description, hwid
    return port


@pytest.fixture
def found(monkeypatch):
    def find(*there):
        monkeypatch.setattr(list_ports, "comports", lambda: [*there])
        return ports()

    return find


@pytest.mark.parametrize(
    ("vid", "pid", "board"),
    [
        (0x1A86, 0x7523, "CH340"),
        (0x10C4, 0xEA60, "CP210x"),
        (0x2341, 0x0243, "Arduino Uno"),
        (0x2341, 0x0010, "Arduino Mega"),
        (0x2341, 0x0042, "Arduino Mega"),
        (0x2341, 0x0058, "Arduino"),
        (0x2A03, 0x0010, "Arduino Mega"),
        (0x2A03, 0x0057, "Arduino"),
        (0x2E8A, 0x0005, "Raspberry Pi Pico"),
        (0x303A, 0x1001, "Espressif"),
        (0x239A, 0x8014, "Adafruit"),
        (0x1B4F, 0x9206, "SparkFun"),
        (0x2886, 0x802F, "Seeed"),
        (0x16C0, 0x0483, "Teensy"),
        (0x0D28, 0x0204, "micro:bit"),
        (0xF055, 0x9800, "MicroPython"),
        *((0x1A86, pid, "CH340") for pid in (0x7522, 0x5523)),
        (0x1A86, 0x55D3, "CH343"),
        (0x1A86, 0x55D4, "CH9102"),
        *((0x10C4, pid, "CP210x") for pid in (0xEA70, 0xEA71)),
        *((0x0403, pid, "FTDI") for pid in (0x6001, 0x6010, 0x6011, 0x6014, 0x6015)),
        *((0x067B, pid, "PL2303") for pid in (0x2303, 0x23A3, 0x23C3, 0x23D3)),
        *((0x2341, pid, "Arduino Uno") for pid in (0x0001, 0x0043)),
        (0x2341, 0x0242, "Arduino Mega"),
        (0x2A03, 0x0043, "Arduino Uno"),
        (0x2A03, 0x0042, "Arduino Mega"),
        *((0x0483, pid, "STM32") for pid in (0x5740, 0x374B, 0x374E)),
    ],
)
def test_the_usual_boards_are_known_by_their_usb_ids(found, vid, pid, board):
    (port,) = found(described("COM7", vid, pid, "USB Serial (COM7)"))
    assert (port.board, port.rank) == (board, BOARD)
    assert port.title == f"{board} (USB Serial (COM7))"


def test_a_maker_of_much_else_is_known_by_its_products_only(found):
    (port,) = found(described("/dev/ttyACM0", 0x1A86, 0x8010))
    assert (port.board, port.rank, port.title) == ("", USB, "")


@pytest.mark.parametrize(
    ("port", "rank"),
    [
        (described("/dev/ttyS0"), BARE),
        (described("/dev/ttyS4", description="ttyS4", hwid="PNP0501"), BARE),
        (described("/dev/ttyAMA0", description="ttyAMA0", hwid="3f201000.serial"), BARE),
        (described("COM1", description="Communications Port (COM1)", hwid="ACPI\\PNP0501\\0"), BARE),
        (described("COM5", description="Standard Serial over Bluetooth link (COM5)", hwid="BTHENUM\\..."), OTHER),
        (described("/dev/rfcomm0"), OTHER),
    ],
)
def test_the_mainboards_own_ports_come_last(found, port, rank):
    board = described("/dev/zzz", 0x1A86, 0x7523)
    listed = found(port, board)
    assert [each.device for each in listed] == ["/dev/zzz", port.device]
    assert listed[1].rank == rank
    assert likely_port(listed).device == "/dev/zzz"
    assert "n/a" not in (*listed[1],)
    with pytest.raises(MotorcadeError, match="No car is found"):
        likely_port(listed[1:])


def test_of_several_likely_ports_none_is_chosen(found):
    listed = found(
        described("COM4", 0x1234, 1), described("COM3", 0x10C4, 0xEA60, "CP210x (COM3)"), described("COM8", 0x303A, 1)
    )
    with pytest.raises(SeveralPortsError) as raised:
        likely_port(listed)
    assert raised.value.ports == [("COM3", "CP210x (COM3)"), ("COM8", "Espressif")]
    assert "COM3 (CP210x (COM3)), COM8 (Espressif)" in str(raised.value)
    assert "COM8 (Espressif)" in raised.value.sentence("zh")


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no groups of this kind")
def test_the_group_to_join_is_the_ports_own(tmp_path, monkeypatch):
    import grp

    port = tmp_path / "ttyUSB0"
    port.touch()
    other = next(group for group in grp.getgrall() if group.gr_name not in ("root", "dialout"))
    monkeypatch.setattr(os, "stat", lambda path: os.stat_result((0o20660, 0, 0, 1, 0, other.gr_gid, 0, 0, 0, 0)))
    assert group_of(str(port)) == other.gr_name


@pytest.mark.parametrize("device", ["COM3", "/dev/there-is-none"])
def test_where_the_group_is_not_known_the_usual_one_is_named(device):
    assert group_of(device) == "dialout"
