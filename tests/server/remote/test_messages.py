"""The messages of the remote's page."""

from typing import get_args

from motorcade.car.arbiter import STATES
from motorcade.server.remote.messages import CarState


def test_the_page_knows_every_state_of_a_car():
    assert get_args(CarState) == (*(name for name, _ in STATES), "away")
