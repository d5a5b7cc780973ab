"""Programs that tests show to the studio."""

from collections.abc import Iterable
from typing import Any

from motorcade import Followers, Program
from motorcade.program.blocks import blocks_of
from motorcade.program.steps import Step


def blocks(leader: list[Step], followers: Followers | list[Step] | None = None) -> dict[str, Any]:
    """The page's message for a program."""
    leads, follows = blocks_of(Program(leader, followers))
    return {"leader": leads, "followers": follows, "profile": "classroom"}


def block_in(state: Any, wanted: str | None) -> Any:
    """The block of a workspace with an id; by None, the first one of the editor."""
    parts = state.values() if isinstance(state, dict) else state if isinstance(state, list) else ()
    if isinstance(state, dict) and "type" in state and wanted in (None, state.get("id")):
        return state
    return next((found for part in parts if (found := block_in(part, wanted))), None)


def table_of(poses: Iterable[tuple[float, float, float]], leads: int = 1, **more: Any) -> dict[str, Any]:
    """A mat of cars at their places (x and y in metres, heading in degrees), of which the first ones lead."""
    cars = [
        {"at_m": [x, y], "heading_deg": heading, "role": "leader" if car < leads else "follower"}
        for car, (x, y, heading) in enumerate(poses)
    ]
    return {"format": "motorcade-mat/1", "name": "Table", "tick_ms": 10, "car": cars, **more}


FORWARD = {"drive": {"direction": "forward", "speed": 2, "seconds": 3}}
LEFT = {"drive": {"direction": "left", "speed": 1, "seconds": 1}}
RIGHT = {"drive": {"direction": "right", "speed": 2, "seconds": 2}}

# What the documents give as an example: forward for three seconds, then left for one.
EXAMPLE = {"format": "motorcade-program/1", "profile": "classroom", "leader": [FORWARD, LEFT], "followers": None}
EMPTY = {**EXAMPLE, "leader": []}
PAIR = {
    "format": "motorcade-mat/1",
    "name": "Pair",
    "size_m": [4, 3],
    "car": [{"at_m": [2, 1.5], "role": "leader"}, {"at_m": [2, 1]}],
}
FOLLOWED = {**EXAMPLE, "followers": {"accept_ir": True, "forward": False, "steps": [RIGHT]}, "mat": PAIR}
FURNISHED = {
    **FOLLOWED,
    "mat": {
        **PAIR,
        "person": [{"path": [[0, 1, 2.5], [4, 3, 2.5]], "repeats": True}],
        "voice": [{"at_s": 1, "word": "stop"}, {"at_s": 2, "word": "go", "centre_m": [2, 1], "radius_m": 0.5}],
    },
}
LIT = {**EXAMPLE, "leader": [{"together": [FORWARD, {"led": {"which": 1, "seconds": 1}}]}]}
LISTENING = {**EXAMPLE, "leader": [{"together": [FORWARD, {"voice": {}}]}]}
SHELTERED = {**EXAMPLE, "followers": {"accept_ir": True, "forward": False, "steps": [{**RIGHT, "accept_ir": False}]}}
TOO_LONG = {**EXAMPLE, "leader": [{"repeat": {"times": 128, "steps": [FORWARD, LEFT]}}]}
