"""Digests of what cars are and where they are, of integers alone, so that they are the same on every computer."""

import numpy as np
from numpy.typing import NDArray

from motorcade.car.brain import SIZE
from motorcade.engine.world import World

CAR_BYTES = 8
# All digests of a sweep together take at most so many bytes, unless its runs have none then; a run has at most so many.
MOST_BYTES = 1 << 24
MOST_CHECKPOINTS = 1000


def checkpoint_ticks(ticks: int, checkpoints: int) -> list[int]:
    """Return after which ticks of a run of ``ticks`` its checkpoints are; the last one is its end."""
    count = min(checkpoints, ticks)
    return [ticks * number // count for number in range(1, count + 1)]


def car_digests(world: World) -> NDArray[np.uint64]:
    """Return a digest of each car, (worlds, cars), in the order of numbers: of its brain, place, heading and wheels."""
    cars = world.state
    digests = np.full(world.worlds * world.cars, 0xCBF29CE484222325, np.uint64)
    # FNV-1a, over numbers in place of bytes.
    for row in (*np.asarray(cars.memory)[:SIZE], cars.x, cars.y, cars.heading, cars.wheels):
        digests = (digests ^ np.asarray(row).astype(np.uint32)) * np.uint64(0x100000001B3)
        digests ^= digests >> np.uint64(29)
    in_order = np.empty((world.worlds, world.cars), np.uint64)
    numbers = np.asarray(cars.number).reshape(world.worlds, world.cars)
    np.put_along_axis(in_order, numbers.astype(np.int64), digests.reshape(in_order.shape), axis=1)
    return in_order
