"""Who gives way where all places of a car are taken."""

import pytest

from motorcade.drive.session import MOST_SESSIONS, ControlSession
from motorcade.drive.wire import DriveError
from motorcade.words.formats import DRIVE
from support.socketless_car import Car


def full_car(clients):
    """A car with a session of each client, told by their first letters; the first one drives."""
    car = Car()
    assert len(clients) == MOST_SESSIONS
    sessions = [ControlSession(car.control, client, client) for client in clients]
    sessions[0].command(DRIVE.encode(angle=90, direction=1, speed=100))
    for session in sessions:
        session.take_place()
    return car, sessions


def comes(car, client):
    ControlSession(car.control, client, client).take_place()


@pytest.mark.parametrize(
    ("taken", "newcomer", "gives"),
    [("eeeemmmmm", "e", None), ("eeebmmmmm", "e", "m"), ("eeemmmmmm", "e", "m"), ("eeeeeeeem", "lin", "e")],
)
def test_a_client_gets_a_place_of_one_that_has_two_more_but_not_the_wheel(taken, newcomer, gives):
    car, sessions = full_car(taken)
    if gives is None:
        with pytest.raises(DriveError) as problem:
            comes(car, newcomer)
        assert problem.value.code == "full"
    else:
        comes(car, newcomer)
        assert [each.client for each in sessions if not each.has_place] == [gives]
        assert sessions[0].drives
