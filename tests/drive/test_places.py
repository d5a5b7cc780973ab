"""Who gives way where all places of a drive server are taken."""

from dataclasses import dataclass

import pytest

from motorcade.drive.places import MOST_SESSIONS, who_gives_way
from motorcade.drive.wire import DriveError

HAND_OVER_MS = 2_000


@dataclass(frozen=True)
class Session:
    number: int
    client: str
    silent_ms: int = 0
    watches: bool = False


def sessions(clients):
    """A full server, told by the first letters of the clients."""
    assert len(clients) == MOST_SESSIONS
    return [Session(number, client) for number, client in enumerate(clients, 1)]


def gives_way(taken, newcomer, driver=0):
    return who_gives_way(taken, newcomer, driver, HAND_OVER_MS)


@pytest.mark.parametrize(("taken", "gives"), [("eeeemmmmm", None), ("eeebmmmmm", "m"), ("eeemmmmmm", "m")])
def test_a_client_gets_a_place_of_one_that_has_two_more(taken, gives):
    if gives is None:
        with pytest.raises(DriveError) as problem:
            gives_way(sessions(taken), Session(99, "e"))
        assert problem.value.code == "full"
    else:
        assert gives_way(sessions(taken), Session(99, "e")).client == gives


@pytest.mark.parametrize("driver", [1, 5])
def test_the_driver_keeps_its_place_however_many_its_client_has(driver):
    assert gives_way(sessions("e" * 8 + "m"), Session(99, "lin"), driver).number != driver


def test_who_is_silent_for_longer_than_a_hand_over_gives_way():
    quiet = [Session(number, f"{number}", HAND_OVER_MS) for number in range(1, MOST_SESSIONS + 1)]
    with pytest.raises(DriveError):
        gives_way(quiet, Session(99, "e"))
    assert gives_way([*quiet[:-1], Session(9, "9", HAND_OVER_MS + 1)], Session(99, "e")).number == 9
