"""Pictures of a studio's world, read as a page reads them."""

import struct

import numpy as np

from motorcade.engine.events import KINDS
from motorcade.service.pictures import EVENT_ROW, PictureColumns


class Picture:
    """A picture as a page reads it."""

    def __init__(self, data: bytes):
        kind, self.flags, _, self.number, self.t_ms, self.cars, events = struct.unpack_from("<BBHIIII", data)
        assert kind == 1
        self.moment = PictureColumns.unpack(self.t_ms, data[20:], self.cars)
        self.events = np.frombuffer(data[len(data) - events * EVENT_ROW.itemsize :], EVENT_ROW)
        assert len(data) == 20 + len(self.moment.pack()) + self.events.nbytes

    def told(self, kind: str) -> list[tuple[int, int]]:
        return self.events[["t_ms", "car"]][self.events["kind"] == KINDS.index(kind)].tolist()
