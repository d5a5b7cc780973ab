"""Pictures of a studio's world, read as a page reads them."""

import struct
from types import SimpleNamespace

import numpy as np

from motorcade.engine.events import KINDS
from motorcade.server.studio.simulation import EVENT_ROW, unpack_moment

_FORMS = ("<f4", "<f4", "<f4", "<u2", "u1", "u1", "u1")
_COLUMNS = ("x_m", "y_m", "heading", "index", "wheels", "led", "flags")


def pack_moment(*columns: list[float]) -> bytes:
    """The columns of a moment, as the engine packs them."""
    packed = b"".join([np.array(column).astype(form).tobytes() for column, form in zip(columns, _FORMS, strict=True)])
    return packed + bytes(-len(packed) % 4)


class Picture:
    """A picture as a page reads it; ``moment`` has the cars' columns by name."""

    def __init__(self, data: bytes):
        kind, self.flags, _, self.number, *counted = struct.unpack_from("<BBHIIIII", data)
        self.t_ms, self.cars, events, self.lost = counted
        assert kind == 1
        at = len(data) - events * EVENT_ROW.itemsize
        assert at == 24 + -(-17 * self.cars // 4) * 4
        self.moment = SimpleNamespace(**dict(zip(_COLUMNS, unpack_moment(data[24:at], self.cars), strict=True)))
        self.events = np.frombuffer(data[at:], EVENT_ROW)

    def happened(self, kind: str) -> list[tuple[int, int]]:
        """The times and cars of the events of a kind."""
        return self.events[["t_ms", "car"]][self.events["kind"] == KINDS.index(kind)].tolist()
