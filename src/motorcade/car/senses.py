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

    Senses = namedtuple("Senses", "obstacle_mm person dark_floor")

# What a car without any sensor senses.
NOTHING = Senses(obstacle_mm=1048576, person=0, dark_floor=0)
