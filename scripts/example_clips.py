"""Write short runs of the example projects, which the studio's list of examples draws: web/src/generated/clips.json."""

import json
import math
from typing import Any

from motorcade.engine.world import World
from motorcade.mats.document import mat_of
from motorcade.service.documents import EXAMPLES, example
from motorcade.service.messages import Blocks
from motorcade.service.programs import compile_blocks, profile_named

EVERY_MS = 200
DURATION_MS = 20_000
# A heading is a whole number of these parts of a turn.
HEADINGS = 256


def example_clips() -> str:
    """The runs of all examples by id, as JSON: the mat, and of each moment x_cm, y_cm, heading and LED of each car."""
    clips = {name: _clip(name) for name in EXAMPLES}
    return json.dumps({"every_ms": EVERY_MS, "headings": HEADINGS, "clips": clips}, separators=(",", ":")) + "\n"


def _clip(name: str) -> dict[str, Any]:
    project = example(name)
    image = compile_blocks(Blocks(project.leader, project.followers, profile=project.profile)).image
    assert project.mat, name
    assert image, name
    world = World(mat_of(project.mat, name), [image], profile_named(project.profile), threads=1, kernels="webassembly")
    moments = [_moment(world)]
    while world.now_ms < DURATION_MS:
        world.run(EVERY_MS)
        moments.append(_moment(world))
    return {"mat": project.mat, "moments": moments}


def _moment(world: World) -> list[int]:
    shown = world.snapshot()
    return [
        number
        for x_m, y_m, heading, led in zip(shown.x_m, shown.y_m, shown.heading, shown.led, strict=True)
        for number in (round(x_m * 100), round(y_m * 100), round(heading / math.tau * HEADINGS) % HEADINGS, int(led))
    ]
