"""Pictures of a studio's world, read as a page reads them."""

from types import SimpleNamespace

import numpy as np

from motorcade.engine.events import KINDS
from motorcade.engine.moment import EVENT_BYTES, PICTURED, moment_bytes, unpack_events, unpack_moment
from motorcade.service.history import HEADER_BYTES, header_of


def pack_moment(*columns: list[float]) -> bytes:
    """The columns of a moment, as the engine packs them."""
    typed = zip(columns, PICTURED.values(), strict=True)
    packed = b"".join([np.array(column).astype(dtype).tobytes() for column, dtype in typed])
    return packed + bytes(-len(packed) % 4)


class Picture:
    """A picture as a page reads it; ``moment`` has the cars' columns by name, ``events`` what happened."""

    def __init__(self, data: bytes):
        header = header_of(data)
        assert header.kind == 1
        self.flags, self.number, self.t_ms = header.flags, header.number, header.t_ms
        self.cars, self.lost = header.cars, header.lost
        at = HEADER_BYTES + moment_bytes(self.cars)
        assert len(data) == at + EVENT_BYTES * header.events
        columns = unpack_moment(data[HEADER_BYTES:at], self.cars)
        self.moment = SimpleNamespace(**{name: np.asarray(column) for name, column in columns.items()})
        self.events = list(unpack_events(data[at:]))

    def happened(self, kind: str) -> list[tuple[int, int]]:
        """The times and cars of the events of a kind."""
        return [(each.t_ms, each.car) for each in self.events if each.kind == KINDS.index(kind)]
