"""Write short runs that the studio's page draws: of the examples, and of what each block does."""

import json
import math
from typing import Any

from motorcade.config.profile import Profile, built_in_profile
from motorcade.engine.world import World
from motorcade.mats.document import mat_of
from motorcade.program.compiler import compile_program
from motorcade.program.model import program_from_dict
from motorcade.program.schema import FORMAT
from motorcade.service.documents import EXAMPLES, example
from motorcade.service.messages import Blocks
from motorcade.service.programs import compile_blocks

EVERY_MS = 200
EXAMPLE_MS = 20_000
BLOCK_MS = 4_000
# A heading is a whole number of these parts of a turn.
HEADINGS = 256

_SIZE_M = (1.0, 0.5)
_LEADER = {"at_m": [0.2, 0.25], "role": "leader"}
_GO = {"drive": {"direction": "forward", "speed": 2, "seconds": 3}}
_SHORT = {"drive": {"direction": "forward", "speed": 2, "seconds": 1}}
_TURN = {"drive": {"direction": "left", "speed": 1, "seconds": 1}}
# It begins at the leader, and bends.
_ROAD = {"points_m": [[0.1, 0.25], [0.35, 0.25], [0.6, 0.4], [0.9, 0.4]]}
# By the kind of block: the leader's steps, and what else there is. The steps show what the block is for.
_BLOCKS: dict[str, tuple[list[dict[str, Any]], dict[str, Any]]] = {
    "drive": ([_SHORT, _TURN], {}),
    "wait": ([_SHORT, {"wait": {"seconds": 1}}], {}),
    "led": ([{"led": {"which": 0, "seconds": 1}}, {"led": {"which": 2, "seconds": 1}}], {}),
    "avoid": (
        [{"drive": {**_GO["drive"], "unless": {"obstacle": 2}}}],
        {"disc": [{"centre_m": [0.75, 0.31], "radius_m": 0.1}]},
    ),
    "voice": (
        [{"drive": {**_GO["drive"], "unless": {"voice": "stop"}}}],
        {"voice": [{"at_s": 1, "word": "stop"}, {"at_s": 2.4, "word": "go"}]},
    ),
    "pir": (
        [{"drive": {**_GO["drive"], "unless": {"person": {}}}}],
        {"person": [{"path": [[0, 0.6, 0.25], [1.2, 0.6, 0.25], [2, 0.6, 3]]}]},
    ),
    "follow_line": ([{"follow_line": {"speed": 2, "seconds": 4}}], {"line": [_ROAD]}),
    "turn_to_line": (
        [{"turn_to_line": {"direction": "left", "speed": 1, "seconds": 3}}],
        {"line": [{"points_m": [[0.2, 0.25], [0.2, 0.5]]}], "spot": []},
    ),
    "dark": (
        [{"drive": {"direction": "random", "speed": 2, "seconds": 4, "unless": {"floor": "either"}}}],
        {"patch": [{"corners_m": [[0.42, 0.05], [0.9, 0.05], [0.9, 0.45], [0.42, 0.45]]}]},
    ),
    "floor": ([{"together": [_GO, {"floor": {}}]}], {"line": [_ROAD]}),
    "repeat": ([{"repeat": {"times": 2, "steps": [_SHORT, {"led": {"which": 1, "seconds": 1}}]}}], {}),
    "together": ([{"together": [_TURN, {"led": {"which": 3, "seconds": 1}}]}], {}),
    "infrared": (
        [{"wait": {"seconds": 1}}],
        {"car": [_LEADER, *({"at_m": [x_m, 0.25], "heading_deg": 180} for x_m in (0.45, 0.65, 0.85))]},
    ),
}
_FOLLOWERS = {"accept_ir": True, "forward": True, "steps": [{"led": {"which": 0, "seconds": 1}}]}


def example_clips() -> str:
    """The runs of all examples by id, as JSON."""
    return _file({name: _example(name) for name in EXAMPLES})


def block_clips() -> str:
    """The runs of all kinds of blocks, as JSON."""
    return _file({kind: _block(kind) for kind in _BLOCKS})


def _file(clips: dict[str, Any]) -> str:
    whole = {"every_ms": EVERY_MS, "headings": HEADINGS, "clips": clips}
    return json.dumps(whole, separators=(",", ":")) + "\n"


def _example(name: str) -> dict[str, Any]:
    project = example(name)
    image = compile_blocks(Blocks(project.leader, project.followers, profile=project.profile)).image
    assert project.mat, name
    assert image, name
    return _clip(project.mat, image, built_in_profile(project.profile), EXAMPLE_MS)


def _block(kind: str) -> dict[str, Any]:
    steps, things = _BLOCKS[kind]
    document: dict[str, Any] = {"format": FORMAT, "profile": "classroom", "leader": steps}
    if kind == "infrared":
        document["followers"] = _FOLLOWERS
    mat = {"format": "motorcade-mat/1", "name": kind, "size_m": _SIZE_M, "edge": "open", "car": [_LEADER], **things}
    profile = built_in_profile("classroom")
    return _clip(mat, compile_program(program_from_dict(document), profile).image, profile, BLOCK_MS)


def _clip(mat: dict[str, Any], image: bytes, profile: Profile, duration_ms: int) -> dict[str, Any]:
    """The mat, and of each moment x_cm, y_cm, heading and LED of each car."""
    world = World(mat_of(mat, mat["name"]), [image], profile, threads=1, kernels="webassembly")
    moments = [_moment(world)]
    while world.now_ms < duration_ms:
        world.run(EVERY_MS)
        moments.append(_moment(world))
    return {"mat": mat, "moments": moments}


def _moment(world: World) -> list[int]:
    shown = world.snapshot()
    return [
        number
        for x_m, y_m, heading, led in zip(shown.x_m, shown.y_m, shown.heading, shown.led, strict=True)
        for number in (round(x_m * 100), round(y_m * 100), round(heading / math.tau * HEADINGS) % HEADINGS, int(led))
    ]
