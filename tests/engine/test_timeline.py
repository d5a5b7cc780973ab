"""Cars do what the blocks say, when they say it: compare simulated cars with an oracle of the blocks' meaning.

The plain world shows what the cars do in each millisecond; test_engine.py proves that the engine does the same.
"""

from dataclasses import replace
from itertools import groupby, pairwise

from hypothesis import assume, given, settings
from hypothesis import strategies as st

from motorcade import Followers, Mat, Physics, Pose, Program, World, compile_program, led, open_table, repeat, wait
from motorcade.config.profile import Profile
from motorcade.engine.events import KINDS
from motorcade.program.steps import Step
from motorcade.words.formats import CONTROL
from motorcade.words.infrared import TAGS, air_us, tagged_frame, to_frame
from support.plain_world import PlainWorld
from support.soak import SOAK
from support.strategies import BRISK, CLASSROOM, rows, single_steps, sums, togethers
from support.timelines import DARK, STILL, Moment, agrees, length_ms, moments, unrolled, watch

PROFILES = st.sampled_from([BRISK, BRISK, CLASSROOM])
LONGEST_MS = 15_000 if SOAK else 8_000
# Cars that send a tagged word three times within the shortest dwell.
UNHURRIED = replace(BRISK, durations_ms=(0, 800, 1600, 2400))
UNHURRIED_S = st.sampled_from([0.8, 1.6, 2.4])
UNIT_US = CLASSROOM.infrared.unit_us
STATE, START = KINDS.index("state"), KINDS.index("start")
# A case that takes a tenth of a second runs with a third of the examples.
SLOW = settings(max_examples=settings().max_examples // 3)


@st.composite
def leader_cases(draw: st.DrawFn) -> tuple[Program, Profile]:
    profile = draw(PROFILES)
    followers = draw(st.sampled_from([None, [wait(profile.durations_ms[1] / 1000)]]))
    program = Program(draw(rows(sums(profile), least=1)), followers)
    assume(len(moments(program.leader, profile.idle_state_ms)) <= LONGEST_MS)
    return program, profile


def table(*poses: Pose) -> Mat:
    """A table with only cars, which neither touch nor shade one another."""
    return replace(open_table(poses), physics=Physics(collisions=False, line_of_sight=False))


def events_of(world: World, duration_ms: int, car: int, kind: int) -> list[tuple[int, int, int]]:
    """Run the world; gives time, word and other of a car's events of one kind."""
    world.run(duration_ms)
    events = world.take_events()
    return events[(events["car"] == car) & (events["kind"] == kind)][["t_ms", "word", "other"]].tolist()


def air_ms(word: int, tag: int) -> int:
    """How long a frame is on the air; tag 0: a bare one."""
    return -(-air_us(tagged_frame(word, tag) if tag else to_frame(word), UNIT_US) // 1000)


class Follower:
    """One follower without disturbances: far from all bodies, its leader at rest and always in range."""

    def __init__(self, program: Program, usual: Profile):
        profile = replace(usual, infrared=replace(usual.infrared, range_mm=1_000_000))
        compiled = compile_program(program, profile)
        assume(compiled.words)
        self.dwell_ms = compiled.dwell_ms
        self.gap_ms = profile.infrared.gap_ms
        self.words = compiled.words[1 + compiled.leader_states :]
        self.round_ms = self.dwell_ms * len(self.words)
        assume(self.round_ms <= LONGEST_MS)
        self.tagged = compiled.tagged
        tags = range(1, TAGS + 1) if self.tagged else [0]
        # Of all its frames.
        self.air_ms = [air_ms(word, tag) for word in self.words for tag in tags]
        self.said = moments(program.followers.steps, profile.idle_state_ms)
        self.place = table(Pose(0, 0), Pose(100, 0)), [compiled.image], profile

    def shown(self, duration_ms: int) -> list[Moment]:
        """What the follower does in each millisecond."""
        return watch(PlainWorld(*self.place), 1, duration_ms)

    def starts(self, duration_ms: int) -> list[tuple[int, int, int]]:
        """When it began each word, the word, and its tag."""
        return events_of(World(*self.place, events=True), duration_ms, 1, START)

    def said_at(self, at_ms: int) -> Moment:
        """What the blocks say at ``at_ms`` of the leader's clock; nothing before 0."""
        return self.said[at_ms % len(self.said)] if at_ms >= 0 else (STILL, DARK)


@st.composite
def followers(draw: st.DrawFn, deaf: bool = False, tagged: bool = False, forward: bool = False) -> Follower:
    usual = draw(PROFILES)
    level_s = usual.durations_ms[1] / 1000
    settings = {"accept_ir": st.sampled_from([None, False])} if deaf else {}
    row = draw(rows(sums(usual, least=1), most=2 if deaf else 4, least=1, **settings))
    if deaf:
        row += draw(st.permutations([led(0, level_s), led(1, level_s, accept_ir=False)]))
    # In a round whose first and last words are equal, a word follows itself across rounds.
    row += draw(st.sampled_from([[], row[:1]]))
    return Follower(Program([], Followers(row, forward=forward, tagged=tagged)), usual)


@SLOW
@given(leader_cases())
def test_a_leader_does_in_each_millisecond_what_its_blocks_say(case: tuple[Program, Profile]) -> None:
    program, profile = case
    said = moments(program.leader, profile.idle_state_ms)
    world = PlainWorld(table(Pose(0, 0)), [compile_program(program, profile).image], profile)
    for at_ms, (wheels, lit) in enumerate(watch(world, 0, 2 * len(said) + 1)):
        wheels_said, led_said = said[at_ms % len(said)]
        assert agrees(wheels, wheels_said), at_ms
        assert lit == led_said, at_ms


@given(leader_cases())
def test_a_leader_begins_a_state_when_each_step_begins(case: tuple[Program, Profile]) -> None:
    program, profile = case
    steps = list(unrolled(program.leader, "leader"))
    compiled = compile_program(program, profile)
    world = World(table(Pose(0, 0)), [compiled.image], profile, events=True)
    begins, at_ms = set(), 0
    for path, step in steps + steps:
        begins.add((at_ms, path))
        at_ms += length_ms(step, profile.idle_state_ms)
    states = [(t_ms, compiled.origins[1 + index][0]) for t_ms, _, index in events_of(world, at_ms, 0, STATE)]
    assert begins <= set(states)
    assert len(states) == 2 * compiled.leader_states


@SLOW
@given(followers() | followers(tagged=True))
def test_a_follower_takes_each_word_within_a_frame_and_a_gap(car: Follower) -> None:
    assume(car.tagged or len(car.words) > 1)
    starts = car.starts(2 * car.round_ms)
    assert [word for _, word, _ in starts] == [*car.words, *car.words]
    waits_ms = 0
    for slot, (t_ms, word, tag) in enumerate(starts):
        earliest_ms = slot * car.dwell_ms + air_ms(word, tag)
        assert earliest_ms <= t_ms <= earliest_ms + waits_ms
        waits_ms = air_ms(word, tag) + car.gap_ms


def assert_follows(car: Follower, late_ms: int = 0) -> None:
    """Check that the car does what the blocks say, one frame later and at most another frame and a gap after that.

    Between the end of a word and the next word it may stand still for so long.
    """
    first_ms, last_ms = min(car.air_ms), 2 * max(car.air_ms) + car.gap_ms + late_ms
    for at_ms, (wheels, lit) in enumerate(car.shown(2 * car.round_ms)):
        # No block is shorter than 50 ms, so none is skipped.
        said = [car.said_at(then_ms) for then_ms in (*range(at_ms - last_ms, at_ms - first_ms, 50), at_ms - first_ms)]
        if (at_ms - last_ms) // car.dwell_ms != (at_ms - first_ms) // car.dwell_ms:
            said.append((STILL, DARK))
        assert any(agrees(wheels, each) for each, _ in said), at_ms
        assert lit in [each for _, each in said], at_ms


@SLOW
@given(followers() | followers(tagged=True))
def test_a_follower_does_what_its_blocks_say(car: Follower) -> None:
    assume(car.tagged or len(car.words) > 1)
    assert_follows(car)


@SLOW
@given(followers(tagged=True, forward=True))
def test_a_follower_that_passes_tagged_words_on_begins_each_once(car: Follower) -> None:
    # While it sends, it doesn't hear the leader, who sends each word three times in its first half second.
    assume(car.dwell_ms >= 800)
    starts = car.starts(2 * car.round_ms)
    assert [word for _, word, _ in starts] == [*car.words, *car.words]
    for slot, (t_ms, word, tag) in enumerate(starts):
        assert air_ms(word, tag) <= t_ms - slot * car.dwell_ms <= 500 + air_ms(word, tag)


def test_a_tagged_word_that_is_the_only_one_does_not_drift() -> None:
    image = compile_program(Program([], Followers([led(0, 3)], tagged=True))).image
    world = World(table(Pose(0, 0), Pose(0.5, 0)), [image], CLASSROOM, events=True)
    starts_ms = [t_ms for t_ms, _, _ in events_of(world, 600_000, 1, START)]
    assert len(starts_ms) == 200
    # At most two frames and a gap behind the leader's clock.
    assert all(50 <= t_ms - 3000 * slot <= 2 * 86 + 5 for slot, t_ms in enumerate(starts_ms))


@SLOW
@given(followers(deaf=True))
def test_each_deaf_word_in_a_row_costs_at_most_one_more_frame_and_gap(car: Follower) -> None:
    assert_follows(car, most_deaf_in_a_row(car) * (max(car.air_ms) + car.gap_ms))


@SLOW
@given(single_steps(UNHURRIED_S), single_steps(UNHURRIED_S, accept_ir=st.just(False)), st.integers(1, 2))
def test_a_deaf_tagged_step_delays_the_next_by_half_a_second_at_most(hears: Step, deaf: Step, times: int) -> None:
    program = Program([], Followers([repeat(times, hears, deaf), hears], tagged=True))
    assert_follows(Follower(program, UNHURRIED), 500)


def most_deaf_in_a_row(car: Follower) -> int:
    """How many words that make deaf follow one another."""
    hears = [bool(CONTROL.decode(word).accept_ir) for word in (*car.words, *car.words)]
    return max((len(list(row)) for word_hears, row in groupby(hears) if not word_hears), default=0)


@SLOW
@given(st.data())
def test_a_single_word_begins_again_within_a_frame_and_a_gap(data: st.DataObject) -> None:
    usual = data.draw(PROFILES)
    seconds = st.sampled_from(usual.durations_ms[1:]).map(lambda level: level / 1000)
    car = Follower(Program([], [data.draw(single_steps(seconds) | togethers(seconds))]), usual)
    assume(len(car.words) == 1)
    duration_ms = 4 * (car.round_ms + 200)
    shown = car.shown(duration_ms)
    starts = [t_ms for t_ms, _, _ in car.starts(duration_ms)]
    assert len(starts) >= 4
    for begin_ms, next_ms in pairwise(starts):
        assert car.dwell_ms <= next_ms - begin_ms <= car.dwell_ms + car.air_ms[0] + car.gap_ms
        for at_ms in range(begin_ms, next_ms):
            wheels, lit = shown[at_ms]
            said = car.said[at_ms - begin_ms] if at_ms - begin_ms < len(car.said) else (STILL, DARK)
            assert agrees(wheels, said[0])
            assert lit == said[1]
