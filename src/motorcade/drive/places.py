"""Who gets one of the nine places of a driven car."""

from collections import Counter
from typing import Protocol, TypeVar

from motorcade.drive.wire import DriveError

MOST_SESSIONS = 9


class _Session(Protocol):
    number: int
    client: str
    watches: bool

    @property
    def silent_ms(self) -> int: ...


_Any = TypeVar("_Any", bound=_Session)


def who_gives_way(sessions: list[_Any], newcomer: _Any, driver: int, hand_over_ms: int) -> _Any | None:
    """The session that gives its place to a newcomer; None where a place is free.

    Where all are taken it is the one that sent no command for longest, if that is more than ``hand_over_ms``; else one
    of the client that has the most, but not the driver's, if that client has two more than the newcomer. A session that
    only watches replaces none for its silence, and while nobody drives one place is kept for a driver.

    Raises:
        DriveError: "full".
    """
    if len(sessions) + (newcomer.watches and not driver) < MOST_SESSIONS:
        return None
    longest = max(sessions, key=lambda session: session.silent_ms)
    if not newcomer.watches and longest.silent_ms > hand_over_ms:
        return longest
    places = Counter(session.client for session in sessions)
    most = max(places.values())
    if most < places[newcomer.client] + 2:
        raise DriveError("full", sessions=MOST_SESSIONS)
    others = [each for each in sessions if places[each.client] == most and each.number != driver]
    return max(others, key=lambda session: session.silent_ms)
