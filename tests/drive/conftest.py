"""Cars that are driven, and a class's keys."""

from datetime import UTC, datetime

import pytest

from motorcade.drive.certificates import CarKeys, make_keys
from support.driven_car import PATIENT, STEADY, DrivenCar


@pytest.fixture
def car():
    with DrivenCar(profile=STEADY) as car:
        yield car


@pytest.fixture
def patient_car():
    with DrivenCar(profile=PATIENT) as car:
        yield car


@pytest.fixture(scope="module")
def keys(tmp_path_factory):
    folder = tmp_path_factory.mktemp("keys")
    make_keys(folder, [CarKeys("ada")], ["lin"], datetime.now(UTC))
    make_keys(folder / "others", [CarKeys("eve")], ["mallory"], datetime.now(UTC))
    return folder
