"""What the page says about a world is true: of the present, of each stored moment, and after each change.

The page runs in Node, from its own sources (`support.page_account`), and gets all that the service sends. What is true
is read from a second, plain implementation of the world (`support.plain_world`).
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motorcade import Followers, Program, compile_program, forward
from motorcade.car.brain import HOLDS, NO_LED, RUNNING, WORD
from motorcade.config.profile import built_in_profile
from motorcade.engine.events import FRAME, HEARD, KINDS, LOSS_REASONS, LOST, OVER
from motorcade.engine.moment import NO_INDEX
from motorcade.engine.simulated_drive import DrivenCars
from motorcade.locales import catalogue, languages
from motorcade.mats import Mat, Pose, Starts
from motorcade.service.studio_world import StudioWorld
from motorcade.service.thoughts import THOUGHTS
from motorcade.service.world_messages import Move, Reset, Seek, Speak, StepWorld, Watch
from motorcade.service.world_session import WorldSession
from motorcade.words.infrared import tag_of, word_of
from motorcade.words.packing import bytes_to_words
from support.page_account import PageAccount, WorldOnPage, claims_of
from support.plain_world import PlainWorld
from support.soak import SOAK
from support.worlds import Case, CrowdedWorld, cases

EVERY_MS = 100
THOUGHTS_FROM_MS = 1500
RUNNING_THOUGHTS = ("blocked", "blockedByCar", "noLine", "damaged")
MOST_THOUGHTS = 5
LEVELS = ("start", "words")
ACTIVITIES = {0: "forward", 1: "left", 2: "right"}
# So many stored moments are looked at in each run of the quick profile; all of them in `make soak`.
FEW = 6


@dataclass
class Truth:
    """What the plain world shows at a moment."""

    claims: dict[str, int]
    x: list[int]
    y: list[int]
    words: list[int | None]
    no_program: list[bool]
    running: list[bool]


@dataclass
class AccountWitness:
    """The plain world, step by step, and what it showed at each moment that the service stores."""

    case: Case
    seed: int
    plain: PlainWorld = field(init=False)
    stored: dict[int, Truth] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.plain = PlainWorld(self.case.mat, self.case.images, self.case.profile, self.seed)
        self.next_ms = 0
        self.store()

    def run(self, ticks: int) -> None:
        for _ in range(ticks):
            self.plain.step()
            if self.plain.now_ms >= self.next_ms:
                self.store()

    def store(self) -> None:
        self.stored[self.plain.now_ms] = self.truth()
        while self.next_ms <= self.plain.now_ms:
            self.next_ms += EVERY_MS

    def truth(self) -> Truth:
        world = self.plain
        counted: Counter[str] = Counter()
        for car, board in enumerate(world.boards):
            counted[f"{'leaders' if board.is_leader else 'followers'}.{self._activity(car)}"] += 1
            counted["lit"] += board.led != NO_LED
        memories = [car.memory for car in world.cars]
        holds = [
            bool(m[RUNNING] if board.is_leader else m[HOLDS]) for m, board in zip(memories, world.boards, strict=True)
        ]
        return Truth(
            {key: count for key, count in counted.items() if count},
            list(world.x),
            list(world.y),
            [m[WORD] if held else None for m, held in zip(memories, holds, strict=True)],
            [board.is_leader and not held for board, held in zip(world.boards, holds, strict=True)],
            [bool(m[RUNNING]) for m in memories],
        )

    def _activity(self, car: int) -> str:
        board = self.plain.boards[car]
        if car in self.plain.driven:
            return "driven" if any(self.plain.driven[car][:2]) else "still"
        if not board.speed_level:
            return "still"
        return "stuck" if board.direction == 0 and self.plain.is_stuck(car) else ACTIVITIES[board.direction]

    def happened(self, from_ms: int, before_ms: int, car: int | None = None) -> Iterator[tuple[int, str]]:
        """Kind and reason of what happened in a time, to all cars or to one."""
        for t_ms, whose, kind, why, _, _ in self.plain.events:
            if from_ms <= t_ms < before_ms and car in (None, whose):
                yield kind, LOSS_REASONS[why]


class Look:
    """Compares all that the page says with a witness."""

    def __init__(self, on_page: WorldOnPage, witness: AccountWitness, language: str, level: str) -> None:
        self.on_page, self.witness, self.language = on_page, witness, language
        on_page.page.do(level=level)

    def watch(self, car: int) -> None:
        """Choose the car whose details are compared."""
        self.car = car
        self.on_page.page.do(choose=car)
        self.on_page.send(Watch(car))

    def compare(self, truth: Truth, t_ms: int) -> None:
        told = self.on_page.page.ask(self.language)
        assert told["tMs"] == t_ms
        if t_ms:
            assert _but_lost(claims_of(told["caption"], self.language)) == truth.claims
        self._announced(told["announced"], truth)
        self._indices(truth)
        self._thoughts(told["thoughts"], truth, t_ms, told["past"])
        self._details(told["details"], truth, t_ms)
        self._lane(told["lane"], t_ms)

    def _announced(self, sentence: str, truth: Truth) -> None:
        """Right after another world begins, the sentence for screen readers speaks of that one."""
        if self.on_page.picture.flags & 2:
            assert _but_lost(claims_of(sentence, self.language)) == truth.claims

    def _details(self, details: dict[str, Any], truth: Truth, t_ms: int) -> None:
        """What stands beside the stage of the chosen car."""
        word, happened = truth.words[self.car], Counter(self.witness.happened(0, t_ms, self.car))
        assert details["car"] == self.car
        assert details["word"] == (None if word is None else f"{word:08x}")
        assert details["runs"] == truth.running[self.car]
        assert (details["frames"], details["heard"]) == (happened[FRAME, ""], happened[HEARD, ""])
        assert details["lost"] == {why: happened[LOST, why] for why in LOSS_REASONS[1:]}
        heard = [
            (at_ms, bits, sender)
            for at_ms, whose, kind, _, bits, sender in self.witness.plain.events
            if (whose, kind) == (self.car, HEARD) and at_ms < t_ms
        ]
        last = details["last_frame"]
        assert (last is None) == (not heard)
        if last:
            at_ms, bits, sender = heard[-1]
            assert (last["t_ms"], last["car"], last["tag"]) == (at_ms, sender, tag_of(bits))
            assert last["word"] == f"{word_of(bits):08x}"

    def _indices(self, truth: Truth) -> None:
        """The stage's colours, the legend and the glowing blocks follow from the index of each car's word."""
        if len(self.witness.case.images) > 1:
            return  # The page has the words of one image.
        words = bytes_to_words(self.witness.case.images[0])
        for car, index in enumerate(self.on_page.picture.moment.index.tolist()):
            shown = None if index == NO_INDEX else words[index]
            # A follower may hold a word whose bits flipped on the way.
            assert shown == (truth.words[car] if truth.words[car] in words[1:] else None)

    def _thoughts(self, thoughts: list[tuple[int, str]], truth: Truth, t_ms: int, past: bool) -> None:
        """What cars think is what their answers to 'Why?' say, and nobody thinks who runs a word and isn't stuck."""
        names = {text: name for name, text in catalogue(self.language)["page"]["mat"]["thoughts"].items()}
        assert t_ms >= THOUGHTS_FROM_MS or not thoughts
        assert len(thoughts) <= MOST_THOUGHTS
        for car, text in thoughts:
            assert not truth.running[car] or names[text] in RUNNING_THOUGHTS
            assert names[text] != "noProgram" or truth.no_program[car]
            if not past:
                assert names[text] == THOUGHTS[self.on_page.session.world.why(car).code]

    def _lane(self, lane: dict[str, Any], t_ms: int) -> None:
        """The lane of the timeline: the word at the shown moment, and a mark wherever something happened."""
        running = None
        for at_ms, whose, kind, _, word, _ in self.witness.plain.events:
            if whose == self.car and at_ms < t_ms:
                running = None if kind == OVER else word if KINDS[kind] in ("state", "start") else running
        assert lane["word"] == running
        for name, kind in (("frame", FRAME), ("heard", HEARD), ("lost", LOST)):
            assert lane[name] == sorted(
                {t for t, whose, each, *_ in self.witness.plain.events if (whose, each) == (self.car, kind)}
            )


def _but_lost(claims: dict[str, int]) -> dict[str, int]:
    """Claims without that of missed words: `web/src/mat/missed.test.ts` compares these."""
    return {key: count for key, count in claims.items() if key != "lost"}


@pytest.fixture(scope="module")
def page() -> Iterator[PageAccount]:
    with PageAccount() as begun:
        yield begun


def begun(case: Case, session: WorldSession, page: PageAccount, driven: DrivenCars) -> WorldOnPage:
    """Show a world in its beginning."""
    world = CrowdedWorld(case.mat, case.images, case.profile, seeds=case.seed, events=True, threads=1)
    on_page = WorldOnPage(session, page)
    on_page.take(session.begin(StudioWorld(world, steering=driven)))
    page.do(range_mm=case.profile.infrared.range_mm)
    return on_page


@settings(max_examples=settings().max_examples if SOAK else 6)
@given(cases(tick_ms=20), cases(), st.sampled_from(languages()), st.sampled_from(LEVELS), st.data())
def test_all_that_the_page_says_is_true_at_each_moment(
    page: PageAccount, case: Case, other: Case, language: str, level: str, data: st.DataObject
) -> None:
    """Two worlds one after another, in which cars are driven by hand, moved and spoken to."""
    session = WorldSession("any", make_world=lambda _: pytest.fail("no world is requested"))
    for each in (case, other):
        driven = DrivenCars()
        on_page, witness = begun(each, session, page, driven), AccountWitness(each, each.seed)
        look = Look(on_page, witness, language, level)
        look.watch(data.draw(st.integers(0, len(each.mat.starts) - 1)))
        look.compare(witness.stored[0], 0)
        for _ in range(data.draw(st.integers(1, 3))):
            witness = look.witness = changed(data.draw(changes(len(each.mat.starts))), on_page, witness, driven)
            ticks = data.draw(st.integers(1, 160))
            on_page.send(StepWorld(ticks))
            witness.run(ticks)
            look.compare(witness.truth(), witness.plain.now_ms)
            stored = sorted(witness.stored)
            chosen = stored if SOAK else data.draw(st.lists(st.sampled_from(stored), max_size=FEW, unique=True))
            for t_ms in chosen:
                on_page.send(Seek(t_ms))
                look.compare(witness.stored[t_ms], t_ms)
            on_page.send(Seek(None))
            look.compare(witness.truth(), witness.plain.now_ms)
        if data.draw(st.booleans()):
            # A page that is loaded again.
            on_page.take(session.connect())
            look.watch(look.car)
            look.compare(witness.truth(), witness.plain.now_ms)


def test_cars_that_something_stops_do_not_drive(page: PageAccount) -> None:
    """A leader reaches the wall with one follower behind it; another one drives along a wall that it touches."""
    program = compile_program(Program([forward(2, 3)], Followers([forward(2, 3)], accept_ir=True)))
    poses = [Pose(1.0, 0.5, 0.0), Pose(0.75, 0.5, 0.0), Pose(0.2, 0.075, 0.0)]
    mat = Mat("Walls", Starts.of(poses, [True, False, False]), 20, (1.5, 1.0), walled=True)
    case = Case(mat, [program.image], built_in_profile("classroom"), 1)
    session = WorldSession("any", make_world=lambda _: pytest.fail("no world is requested"))
    on_page, witness = begun(case, session, page, DrivenCars()), AccountWitness(case, 1)
    look = Look(on_page, witness, "en", "start")
    look.watch(0)
    told = []
    for _ in range(40):
        on_page.send(StepWorld(5))
        witness.run(5)
        look.compare(witness.truth(), witness.plain.now_ms)
        told.append(claims_of(page.ask("en")["caption"], "en"))
    stuck = [(claims.get("leaders.stuck", 0), claims.get("followers.stuck", 0)) for claims in told]
    assert stuck[0] == (0, 0)
    assert stuck[-1] == (1, 1)
    assert all("followers.forward" in claims for claims in told[10:])


def changes(cars: int) -> st.SearchStrategy[tuple[Any, ...] | None]:
    """What `changed` takes: None, or the kind of a change between two runs and what it needs."""
    car, mm = st.integers(0, cars - 1), st.integers(0, 1500)
    setpoint = st.none() | st.tuples(st.integers(0, 180), st.integers(0, 1), st.sampled_from([0, 1, 100, 255]))
    return st.one_of(
        st.none(),
        st.tuples(st.just("move"), car, mm, mm),
        st.tuples(st.just("speak"), st.sampled_from(["stop", "go"])),
        st.tuples(st.just("drive"), car, setpoint),
        st.tuples(st.just("reset"), st.integers(0, 9)),
    )


def changed(
    change: tuple[Any, ...] | None, on_page: WorldOnPage, witness: AccountWitness, driven: DrivenCars
) -> AccountWitness:
    """Change the world on the page, and that of its witness; return the next witness."""
    match change:
        case ("move", car, x_mm, y_mm):
            on_page.send(Move(car, x_mm / 1000, y_mm / 1000))
            witness.plain.move(car, Pose(x_mm / 1000, y_mm / 1000, 0.0))
        case ("speak", word):
            on_page.send(Speak(word))
            witness.plain.say(word)
        case ("drive", car, setpoint):
            driven.board(car, has_program=True).setpoint = setpoint
            if setpoint is None:
                witness.plain.give_back(car)
            else:
                witness.plain.drive(car, *setpoint)
        case ("reset", seed):
            on_page.send(Reset(seed))
            anew = AccountWitness(replace(witness.case, seed=seed), seed)
            anew.plain.driven = dict(witness.plain.driven)
            return anew
    return witness
