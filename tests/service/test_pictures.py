"""A picture, byte by byte."""

import numpy as np

from motorcade.engine.events import EVENT
from motorcade.service.pictures import (
    FIRST,
    HEARD,
    MOST_EVENTS,
    NO_INDEX,
    PAST,
    RUNS,
    SENDS,
    PictureColumns,
    event_rows,
    pack_picture,
)

MOMENT = PictureColumns(
    1500,
    np.array([0.0, -1.5]),
    np.array([0.25, 2.0]),
    np.array([0.0, 0.5]),
    np.array([1, NO_INDEX], np.uint16),
    np.array([2, 4 + 1], np.uint8),
    np.array([4, 0], np.uint8),
    np.array([RUNS | SENDS, HEARD], np.uint8),
)
EVENTS = np.array([(1499, 0, 1, 5, 5, 0xA3000001, 7)], EVENT)
GOLDEN = """
01 03 0000  08070605  dc050000  02000000  01000000  a picture, of the past and the first; its number, t_ms, cars, events
00000000 0000c0bf                                   x_m
0000803e 00000040                                   y_m
00000000 0000003f                                   heading
0100 ffff                                           held
02 05                                               wheels: forward at level 2, left at level 1
04 00                                               led: none, the first
03 08                                               flags
0000                                                to a whole number of four bytes
db050000 01000000 05 05 0000 010000a3 07000000      lost by collision at 1.499 s: car 1 a word of car 7
"""


def test_the_bytes_of_a_picture() -> None:
    rows = [line.split("  a pict")[0][:52] for line in GOLDEN.strip().splitlines()]
    packed = pack_picture(0x05060708, PAST | FIRST, 1500, 2, MOMENT.pack(), event_rows(EVENTS))
    assert packed.hex(" ", 4) == bytes.fromhex("".join(rows)).hex(" ", 4)


def test_a_moment_comes_back_as_it_was() -> None:
    back = PictureColumns.unpack(1500, MOMENT.pack(), 2)
    assert [np.asarray(each).tolist() for each in back] == [np.asarray(each).tolist() for each in MOMENT]


def test_a_picture_tells_the_newest_where_too_much_happened() -> None:
    events = np.zeros(MOST_EVENTS + 10, EVENT)
    events["t_ms"] = np.arange(len(events))
    packed = pack_picture(0, 0, 0, 2, MOMENT.pack(), event_rows(events))
    told = np.frombuffer(packed[-MOST_EVENTS * 20 :], "<u4").reshape(-1, 5)
    assert told[[0, -1], 0].tolist() == [10, MOST_EVENTS + 9]
    assert int.from_bytes(packed[16:20], "little") == MOST_EVENTS
