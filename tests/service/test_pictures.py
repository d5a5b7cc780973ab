"""A picture, byte by byte, the moments and events that are stored for pictures of the past, and events as a table."""

import csv

import pytest

from motorcade.engine.events import KINDS, LOSS_REASONS
from motorcade.engine.moment import EVENT_ROW, HEARD, NO_INDEX, RUNS, SENDS, unpack_events, unpack_moment
from motorcade.errors import MotorcadeError
from motorcade.locales import catalogue, languages
from motorcade.service.history import FIRST, MOST_EVENTS, PAST, History, event_table, pack_picture
from motorcade.words.infrared import tagged_frame
from support.pictures import Picture, pack_moment


def test_the_page_has_a_text_for_each_reason_of_loss():
    for language in languages():
        assert list(catalogue(language)["page"]["mat"]["lost"]) == list(LOSS_REASONS[1:])


COLUMNS = [[0.0, -1.5], [0.25, 2.0], [0.0, 0.5], [1, NO_INDEX], [2, 4 + 1], [4, 0], [RUNS | SENDS, HEARD]]
MOMENT = pack_moment(*COLUMNS)
EVENTS = EVENT_ROW.pack(1499, 1, 5, 5, 0xA3000001, 7)
GOLDEN = """
01 03 0000  08070605  dc050000  02000000  01000000  a picture, of the past and the first; its number, t_ms, cars, events
09000000                                            frames lost lately
00000000 0000c0bf                                   x_m
0000803e 00000040                                   y_m
00000000 0000003f                                   heading
0100 ffff                                           index of the word
02 05                                               wheels: forward at level 2, left at level 1
04 00                                               led: none, the first
03 08                                               flags
0000                                                to a whole number of four bytes
db050000 01000000 05 05 0000 010000a3 07000000      lost by collision at 1.499 s: car 1 a word of car 7
"""


def test_the_bytes_of_a_picture() -> None:
    rows = [line.split("  a pict")[0][:52] for line in GOLDEN.strip().splitlines()]
    packed = pack_picture(0x05060708, PAST | FIRST, 1500, 2, 9, MOMENT, EVENTS)
    assert packed.hex(" ", 4) == bytes.fromhex("".join(rows)).hex(" ", 4)


def test_a_moment_is_unpacked_unchanged() -> None:
    assert [column.tolist() for column in unpack_moment(MOMENT, 2).values()] == COLUMNS


def test_a_picture_has_the_newest_events_where_there_are_too_many() -> None:
    packed = pack_picture(0, 0, 0, 2, 0, MOMENT, rows_at(*range(MOST_EVENTS + 10)))
    assert [event.t_ms for event in Picture(packed).events] == list(range(10, MOST_EVENTS + 10))


def rows_at(*times_ms: int) -> bytes:
    return b"".join(EVENT_ROW.pack(t_ms, 0, 0, 0, 0, 0) for t_ms in times_ms)


def times_of(events: bytes) -> list[int]:
    return [event.t_ms for event in unpack_events(events)]


def test_stored_events_are_found_by_time_across_batches() -> None:
    history = History()
    for batch in ((10, 20, 20), (30,), (40, 50)):
        history.add_events(rows_at(*batch))
    assert times_of(history.events_between(10, 40)) == [20, 20, 30, 40]
    assert times_of(history.events_between(50, 90)) == []
    assert times_of(history.newest_events(4)) == [20, 30, 40, 50]


def test_the_oldest_moments_and_events_are_dropped_first() -> None:
    history = History((500, 500))
    for t_ms in range(0, 1000, 100):
        history.add_moment(t_ms, bytes(72))
        history.add_events(rows_at(t_ms))
    assert history.earliest_ms == 800
    assert history.moment_at(0)[0] == 800
    assert [times_of(batch) for batch in history.events()] == [[700], [800], [900]]


FRAME, LOST, START = (KINDS.index(kind) for kind in ("frame", "lost", "start"))


def rows_of(*events):
    return b"".join(EVENT_ROW.pack(*event) for event in events)


def test_a_table_has_a_row_for_each_event_and_words_without_their_tags():
    word = 0x65800000
    parity = LOSS_REASONS.index("parity")
    sent = rows_of(
        (5, 1, START, 0, word, 3), (7, 0, FRAME, 0, tagged_frame(word, 3), 0), (9, 2, LOST, parity, 0xFFFFFFFF, 1)
    )
    table = list(csv.DictReader(event_table(sent).text.splitlines()))
    assert [list(row.values()) for row in table] == [
        ["5", "1", "start", "", "0x65800000", "3", "3"],
        ["7", "0", "frame", "", "0x65800000", "0", "3"],
        ["9", "2", "lost", "parity", "0xFFFFFFFF", "1", "0"],
    ]
    assert event_table(b"").text.strip() == "t_ms,car,event,why,word,other,tag"


@pytest.mark.parametrize("rows", [b"\0" * 19, b"\xff" * 20])
def test_other_bytes_are_refused(rows):
    with pytest.raises(MotorcadeError) as refused:
        event_table(rows)
    assert refused.value.code == "bad-message"
