"""A class without a server, for tests of its core."""

from random import Random

import pytest

from motorcade.classroom.app import class_view
from motorcade.classroom.messages import AVATARS, MatView
from motorcade.classroom.record import new_record
from motorcade.classroom.room import Classroom
from motorcade.errors import MotorcadeError

MAT = MatView("closed", None, {}, 0, [])
BUS = AVATARS[0]


def a_class(cars=(), seed=1):
    below = Random(seed).randrange
    return Classroom(new_record(below), below, cars)


def with_pupils(*names, cars=()):
    room = a_class(cars)
    for number, name in enumerate(names):
        room.join(name, BUS, f"device {number}", f"address {number}", 0.0)
    return room


def refused(code, act, *arguments):
    with pytest.raises(MotorcadeError) as found:
        act(*arguments)
    assert found.value.code == code
    return found.value


def row(room, pupil, now_s=0.0):
    return next(each for each in class_view(room, MAT, now_s).pupils if each.id == pupil)
