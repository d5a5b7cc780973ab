"""What a car senses: a record with a name for each sense.

Portable. Written by scripts/generate.py from `motorcade.devices`; don't edit.
"""

# For the type checker alone: MicroPython has no such module.
MYPY = False
if MYPY:
    from typing import NamedTuple

    class Senses(NamedTuple):
        """What a car senses in a tick.

        Attributes:
            obstacle_mm: the distance of the nearest obstacle ahead in mm.
            person: 1 while a person is near, else 0.
            dark_floor: the floor sensors over dark floor, 1 the left plus 2 the right one.
        """

        obstacle_mm: int
        person: int
        dark_floor: int

else:
    from collections import namedtuple

    Senses = namedtuple(
        "Senses",
        (
            "obstacle_mm",
            "person",
            "dark_floor",
        ),
    )

from motorcade.car.board import NOTHING_IN_SIGHT_MM, Board

# What a car without any sensor senses.
NOTHING = Senses(NOTHING_IN_SIGHT_MM, 0, 0)


def read_senses(board: Board, looks_mm: int) -> Senses:
    """Read the sensors of ``board``; with ``looks_mm`` 0 no obstacle matters and the ultrasonic sensor stays off."""
    return Senses(
        board.obstacle_mm() if looks_mm else NOTHING_IN_SIGHT_MM,
        1 if board.sees_person() else 0,
        board.dark_floor(),
    )
