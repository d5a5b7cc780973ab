"""Worlds that run without NumPy too, and digests of them: this file also runs in a browser."""

import hashlib

from motorcade.engine.moment import COLUMNS
from motorcade.engine.simulation import Simulation
from motorcade.service.studio_world import StudioWorld


def state_hash(world: Simulation) -> str:
    """A digest of all cars, of what was counted and of the events that were not taken yet."""
    memory, state = world.backend, world.state
    summed = hashlib.sha256()
    for array in (*(state.rows[row] for row in range(state.rows.shape[0])), state.wheels, state.program):
        summed.update(memory.read(array))
    for which in range(world.worlds):
        summed.update(repr(world.totals(which)).encode() + memory.read(world.take_rows(which)))
        shown = world.snapshot(which)
        summed.update(b"".join([bytes(getattr(shown, name)) for name in COLUMNS]))
    return summed.hexdigest()


def page_hash(studio: StudioWorld, duration_ms: int, watched: int) -> str:
    """A digest of what a page gets in so many ms: pictures, stored moments, events, and the details of a car."""
    summed = hashlib.sha256()
    for _ in range(duration_ms // 100):
        summed.update(
            studio.run(100) + studio.pictures.moment(is_stored=True) + studio.pictures.moment(is_stored=False)
        )
        summed.update(repr(studio.details(watched)).encode() + repr(studio.simulation.totals()).encode())
    return summed.hexdigest()
