"""What a world has shown and told so far, as far back as there is room for."""

from bisect import bisect_right
from collections import deque
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from motorcade.service.pictures import EVENT_ROW, PictureColumns

EVERY_MS = 100
MOMENT_BYTES = 24 << 20
EVENT_BYTES = 12 << 20
# What Python needs for each object, however little is in it.
_OBJECT_BYTES = 128
_NONE = np.zeros(0, EVENT_ROW)


class History:
    """Moments and events in order of time; the oldest of each go when there is no more room."""

    def __init__(self, moment_bytes: int = MOMENT_BYTES, event_bytes: int = EVENT_BYTES):
        self._room = moment_bytes, event_bytes
        self._times: deque[int] = deque()
        self._moments: deque[bytes] = deque()
        self._events: deque[NDArray[np.void]] = deque()
        self._moments_held = self._events_held = 0

    def keep_moment(self, t_ms: int, moment: bytes) -> None:
        """Take a packed moment, later than all before."""
        self._times.append(t_ms)
        self._moments.append(moment)
        self._moments_held += len(moment) + _OBJECT_BYTES
        while self._moments_held > self._room[0] and len(self._moments) > 1:
            self._times.popleft()
            self._moments_held -= len(self._moments.popleft()) + _OBJECT_BYTES

    def keep_events(self, events: NDArray[np.void]) -> None:
        """Take rows of EVENT_ROW that happened after those before."""
        if not len(events):
            return
        self._events.append(events)
        self._events_held += events.nbytes + _OBJECT_BYTES
        while self._events_held > self._room[1] and len(self._events) > 1:
            self._events_held -= self._events.popleft().nbytes + _OBJECT_BYTES

    @property
    def earliest_ms(self) -> int:
        """When the oldest moment is; 0 where there is none."""
        return self._times[0] if self._times else 0

    @property
    def latest_ms(self) -> int:
        """When the newest moment is; 0 where there is none."""
        return self._times[-1] if self._times else 0

    def moment_at(self, t_ms: int) -> tuple[int, bytes]:
        """The last moment until ``t_ms``, or else the oldest: its time and its bytes. There is at least one."""
        at = max(bisect_right(self._times, t_ms) - 1, 0)
        return self._times[at], self._moments[at]

    def events_between(self, after_ms: int, until_ms: int) -> NDArray[np.void]:
        """The events later than the one time and not later than the other."""
        near = [batch for batch in self._events if batch["t_ms"][-1] > after_ms and batch["t_ms"][0] <= until_ms]
        events = np.concatenate([_NONE, *near])
        return events[(events["t_ms"] > after_ms) & (events["t_ms"] <= until_ms)]

    def newest_events(self, most: int) -> NDArray[np.void]:
        """The last ``most`` events."""
        batches: deque[NDArray[np.void]] = deque()
        count = 0
        for batch in reversed(self._events):
            batches.appendleft(batch)
            count += len(batch)
            if count >= most:
                break
        return np.concatenate([_NONE, *batches])[-most:]

    def events(self) -> list[NDArray[np.void]]:
        """All events, in batches."""
        return list(self._events)

    def moments(self, cars: int, after_ms: int) -> Iterator[PictureColumns]:
        """The moments from ``after_ms`` on, as they are now."""
        held = [each for each in zip(self._times, self._moments, strict=True) if each[0] >= after_ms]
        return (PictureColumns.unpack(t_ms, data, cars) for t_ms, data in held)
