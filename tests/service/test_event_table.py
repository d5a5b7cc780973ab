"""The table of a run's events, from the page's rows."""

import csv

import pytest

from motorcade.engine.events import KINDS, LOSS_REASONS
from motorcade.engine.moment import EVENT_ROW
from motorcade.errors import MotorcadeError
from motorcade.service.history import event_table
from motorcade.service.messages import EventRows
from motorcade.words.infrared import tagged_frame

FRAME, LOST, START = (KINDS.index(kind) for kind in ("frame", "lost", "start"))


def rows_of(*events):
    return EventRows(b"".join(EVENT_ROW.pack(*event) for event in events))


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
    assert event_table(EventRows(b"")).text.strip() == "t_ms,car,event,why,word,other,tag"


@pytest.mark.parametrize("rows", [b"\0" * 19, b"\xff" * 20])
def test_other_bytes_are_refused(rows):
    with pytest.raises(MotorcadeError) as refused:
        event_table(EventRows(rows))
    assert refused.value.code == "bad-message"
