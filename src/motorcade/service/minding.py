"""What a car minds now: the sense without which its wheels would turn otherwise, asked of the brain itself."""

from motorcade.car import brain
from motorcade.car.senses import Senses
from motorcade.config.profile import levels_of
from motorcade.engine import agents
from motorcade.engine.simulation import Simulation
from motorcade.errors import Phrase
from motorcade.words.formats import CONTROL

_FAR_MM = 1 << 20


def minded(world: Simulation, car: int) -> Phrase | None:
    """Return why a car stands or turns while its word drives; None where it does what the word says."""
    levels = levels_of(world.profile)
    sensed = memoryview(world.backend.read(world.read_senses())).cast("q")[car * agents.SENSED :]
    obstacle_mm = sensed[agents.OBSTACLE_MM]
    person = sensed[agents.PERSON]
    dark = sensed[agents.DARK_FLOOR]
    memory = world.memory_of(car, range(brain.SIZE))
    values = CONTROL.decode(memory[brain.WORD])
    unheard = [*memory]
    unheard[brain.STOPPED] = 0
    light = dark
    if values.motor_direction == brain.RANDOM_FORWARD:
        light = 0
    # Each sense is taken away beside those before it, in the order in which the brain asks them.
    without = (
        ("voice", unheard, Senses(obstacle_mm, person, dark)),
        ("person", unheard, Senses(obstacle_mm, 0, dark)),
        ("obstacle", unheard, Senses(_FAR_MM, 0, dark)),
        ("floor", unheard, Senses(_FAR_MM, 0, light)),
    )
    does = brain.wheels([*memory], Senses(obstacle_mm, person, dark), world.now_ms, levels)
    for sense, remembered, senses in without:
        if brain.wheels([*remembered], senses, world.now_ms, levels) != does:
            cm = levels[brain.AVOID_RADII_MM + values.avoid_radius] / 10
            return Phrase(f"why-minds-{sense}", **({"cm": f"{cm:g}"} if sense == "obstacle" else {}))
    return None
