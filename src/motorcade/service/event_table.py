"""The events of a run as a table: CSV."""

import csv
import io
import struct
from collections.abc import Iterable

from motorcade.engine.events import KINDS, LOSS_REASONS
from motorcade.errors import MotorcadeError
from motorcade.service.messages import EventRows, Text
from motorcade.words.infrared import tag_of, word_of

COLUMNS = ("t_ms", "car", "event", "why", "word", "other", "tag")
# As in a picture: time, car, kind with the reason in the byte above, word, and other.
_ROW = struct.Struct("<5I")


def table_text(rows: Iterable[tuple[int, int, int, int, int, int]], has_head: bool = False) -> str:
    """Return events as CSV.

    Args:
        rows: of each event time in ms, car, kind and reason (indices of `motorcade.engine.events`), word and other.
        has_head: whether the names of the columns come first.
    """
    text = io.StringIO()
    writer = csv.writer(text)
    if has_head:
        writer.writerow(COLUMNS)
    for t_ms, car, kind, why, word, other in rows:
        name, tag = KINDS[kind], 0
        if name == "start":
            tag = other
        elif name in ("frame", "heard") and tag_of(word):
            word, tag = word_of(word), tag_of(word)
        writer.writerow((t_ms, car, name, LOSS_REASONS[why], f"0x{word:08X}", other, tag))
    return text.getvalue()


def event_table(sent: EventRows) -> Text:
    """Return the page's events as CSV. Raises MotorcadeError where they aren't whole rows of events."""
    try:
        rows = _ROW.iter_unpack(sent.rows)
        split = ((t_ms, car, kind & 255, kind >> 8, word, other) for t_ms, car, kind, word, other in rows)
        return Text(table_text(split, has_head=True))
    except (struct.error, IndexError):
        raise MotorcadeError("bad-message", reason="these are no rows of events") from None
