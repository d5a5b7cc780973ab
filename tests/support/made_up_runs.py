"""Missions and runs that a test makes up, moment by moment."""

from array import array
from typing import Any

from motorcade.engine.events import START
from motorcade.engine.moment import COLUMNS, Event, Moment
from motorcade.locales import languages
from motorcade.missions.document import mission_of
from motorcade.missions.goal import EVERY_MS
from motorcade.missions.watch import MissionWatch
from motorcade.program.compiler import compile_program
from motorcade.program.model import Followers, Program
from motorcade.program.steps import forward, led, wait

LEADER, FIRST, SECOND = range(3)
MAT = {
    "size_m": [6, 2],
    "car": [{"at_m": [0.5, 1], "role": "leader"}, {"at_m": [1, 1]}, {"at_m": [1.5, 1]}],
    "voice": [{"at_s": 0.2, "word": "stop"}, {"at_s": 0.8, "word": "go"}],
}
SQUARE = {"name": "home", "corners_m": [[2, 0], [4, 0], [4, 2], [2, 2]]}
DISC = {"name": "lake", "centre_m": [3, 1], "radius_m": 0.5}
# One word for 1 s, so the slots begin at 0, 1, 2 … s; the leader has two states.
BARE = Program([wait(1), forward(1)], Followers([led(1, 1)], tagged=False))
TAGGED = Program([wait(1)], Followers([led(1, 1)], tagged=True))
NO_LED = 4


def mission(*goals, seconds=1.0, **more):
    document = {"format": "motorcade-mission/1", "name": "m", "seconds": seconds, "mat": MAT, "zone": [SQUARE, DISC]}
    return mission_of({**document, "goal": [*goals], **more}, "m")


def moment(t_ms, x=(0.5, 1.0, 1.5), y=(1.0, 1.0, 1.0), heading=(0.0, 0.0, 0.0), **more):
    shown: dict[str, Any] = {"wheels": (0, 0, 0), "led": (NO_LED,) * 3, "touching_ms": 0} | more
    columns: dict[str, Any] = {name: bytes(shown.get(name, (0, 0, 0))) for name in COLUMNS}
    columns |= {"x_m": array("f", x), "y_m": array("f", y), "heading": array("f", heading)}
    return Moment(t_ms, counts={"touching_ms": shown["touching_ms"]}, **columns)


def watched(goals, *more, **options):
    """The states of goals at the end of a run."""
    return run_seen(goals, *more, **options).states()


def run_seen(goals, moments, events=(), seconds=1.0, program=BARE, walled=False):
    """The watch of goals at the end of a run; each of ``moments`` is what `moment` takes beside the time."""
    mat = MAT | ({"edge": "wall"} if walled else {})
    wanted = mission(*goals, seconds=seconds, mat=mat)
    watch = MissionWatch(wanted, compile_program(program, wanted.profile).image)
    for number in range(round(seconds * 1000) // EVERY_MS + 1):
        t_ms = number * EVERY_MS
        shown = moments[min(number, len(moments) - 1)]
        watch.see(moment(t_ms, **shown), [each for each in events if t_ms - EVERY_MS < each[0] <= t_ms])
    assert watch.is_over
    return watch


def outcome(goals, moments, *more, **options):
    """How it stands with the last goal at the end of a run: what came of it, when, and the cars that show why."""
    state = watched(goals if isinstance(goals, list) else [goals], moments, *more, **options)[-1]
    for language in languages():
        assert "{" not in state.why.sentence(language)
    return state.progress, state.t_ms, *sorted(state.cars)


def at(x):
    """The first follower stands at x, the others where they begin."""
    return {"x": (0.5, x, 1.5)}


IN, OUT = at(2.5), at(1.0)
ZONE = {"kind": "in-zone", "who": [FIRST], "zone": "home"}


def begins(t_ms, car, tag=0):
    """A follower begins the word of BARE or TAGGED."""
    word = compile_program(TAGGED if tag else BARE).words[-1]
    return Event(t_ms, car, START, 0, word, tag)


ALL_HEARD = [begins(slot * 1000 + 50 * car, car) for slot in range(3) for car in (FIRST, SECOND)]
