"""Luck meters in a simulated lesson: who tries a program with other luck waits for nobody who tries many."""

import asyncio
import base64
from functools import cache
from typing import TYPE_CHECKING, Any

from tests.faults import lesson_teacher
from tests.faults.lesson_doors import MISSION
from tests.faults.lesson_work import FAILS, IMAGE, SOLVES
from tests.faults.system import Replaced

from motorcade import compile_program
from motorcade.server.studio import app as studio_app
from motorcade.service.messages import MissionChoice
from motorcade.service.trials import TrialMessage, TrialSession, Try

if TYPE_CHECKING:
    from tests.faults.browsers import SimulatedPage
    from tests.faults.lesson import Lesson, Pupil

# What one call computes takes so long; the answer of few runs is there after so long.
_CALL_S, _SOON_S = 0.02, 8.0
_FEW, _MANY = 20, 48
GOOD, BAD = (base64.b64encode(compile_program(program).image).decode() for program in (SOLVES, FAILS))


class CountedTrials(TrialSession):
    """Trials whose computing takes a time of the world's, and that note whose turn it was."""

    def __init__(self, run: "Lesson", most_cars: int) -> None:
        super().__init__(most_cars)
        self._run = run
        self._runs = 0

    def receive(self, message: TrialMessage) -> list[Any]:
        if isinstance(message, Try):
            self._runs = message.runs
        return super().receive(message)

    def advance(self) -> list[Any]:
        self._run.world.sleep(_CALL_S)
        self._run.turns.append(self._runs)
        return super().advance()


@cache
def known_luck(image: str) -> dict[str, Any]:
    """The luck of a program in few runs, as it is without a server."""
    session = TrialSession(500)
    answers: list[Any] = session.receive(Try(MissionChoice(id=MISSION), base64.b64decode(image), _FEW))
    while session.is_busy:
        answers += session.advance()
    last = answers[-1]
    return {"works": last.works, "tried": last.tried, "of": last.of, "failed": last.failed}


def _try(page: "SimulatedPage", image: str, runs: int) -> None:
    page.send({"do": "try", "mission": {"id": MISSION}, "image": image, "runs": runs})


async def luck(run: "Lesson") -> None:
    """A pupil tries a program with other luck while another's pages try without end: the turns are shared."""
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    other = run.draw([each for each in run.pupils if each is not pupil])
    greedy: list[SimulatedPage] = []
    if other:
        greedy = [(await other.browser.open("trials")).follow() for _ in range(run.random.choice((0, 1, 5)))]
    for page in greedy:
        _try(page, GOOD, _MANY)
    await asyncio.sleep(0.1)
    await _try_few(run, pupil)
    if other and greedy and run.random.random() < 0.3:
        await _remove_while_trying(run, other, greedy)
    for page in greedy:
        page.close()
    await asyncio.sleep(1.0)
    turns = len(run.turns)
    await asyncio.sleep(0.5)
    run.world.keep("bounded", len(run.turns) == turns, "the server tries on for pages that have left")


async def _try_few(run: "Lesson", pupil: "Pupil") -> None:
    page = (await pupil.browser.open("trials")).follow()
    if run.random.random() < 0.4:
        await _nonsense(run, page)
    image = run.random.choice((GOOD, BAD, IMAGE))
    run.turns.clear()
    _try(page, image, _FEW)
    end_s = run.world.now_s + _SOON_S
    shown: dict[str, Any] = {}
    while shown.get("tried") != _FEW and run.world.now_s < end_s and not page.has_ended:
        await asyncio.sleep(0.05)
        shown = page.newest("luck") or {}
    own = run.turns.count(_FEW)
    others = len(run.turns) - own
    run.world.keep("nobody-waits", shown.get("tried") == _FEW, f"{pupil.name} still waits: {page.messages[-1:]}")
    # The page sees its last answer a few turns later.
    run.world.keep("nobody-waits", others <= own + 6, f"{pupil.name} has {own} turns, another {others}")
    known = known_luck(image)
    told = {key: shown.get(key) for key in known}
    run.world.keep("as-asked", told == known, f"the luck is {told}, not {known}")
    if known["failed"]:
        await _explain(run, page, known["failed"][0])
    page.close()


async def _nonsense(run: "Lesson", page: "SimulatedPage") -> None:
    """What is wrong is refused in a sentence, and ends nothing."""
    _try(page, GOOD, 0)
    _try(page, "AAAA", _FEW)
    page.send({"do": "explain", "seed": 1})
    await asyncio.sleep(0.3)
    errors = len(page.codes())
    run.world.keep("says-why", errors == 2 and not page.has_ended, f"nonsense gives {page.codes()}")


async def _explain(run: "Lesson", page: "SimulatedPage", seed: int) -> None:
    page.send({"do": "explain", "seed": seed})
    end_s = run.world.now_s + _SOON_S
    while not page.newest("failure") and run.world.now_s < end_s:
        await asyncio.sleep(0.1)
    failure = page.newest("failure") or {}
    run.world.keep("as-asked", failure.get("seed") == seed, f"{seed} isn't explained: {failure}")


async def _remove_while_trying(run: "Lesson", pupil: "Pupil", pages: "list[SimulatedPage]") -> None:
    """Whose pages try is removed: the computing ends, they are told nothing, and what they ask for isn't done."""
    await lesson_teacher.remove_pupil(run, pupil)
    await asyncio.sleep(3.0)
    turns, told = len(run.turns), [len(page.messages) for page in pages]
    for page in pages:
        _try(page, GOOD, _MANY)
    await asyncio.sleep(1.0)
    run.world.keep("out-is-out", len(run.turns) == turns, f"the server tries for {pupil.name}, who is out")
    is_told = [len(page.messages) for page in pages] != told
    run.world.keep("out-is-out", not is_told, f"{pupil.name}, who is out, is told of trials")
    left = [page for page in pages if not page.has_ended]
    run.world.keep("out-is-out", not left, f"{len(left)} pages of {pupil.name}, who is out, stay")


def names(run: "Lesson") -> Replaced:
    return {(studio_app, "TrialSession"): lambda most_cars: CountedTrials(run, most_cars)}


ACTS = [(0.45, luck)]
