"""Five experiments beside their theory; ``python benchmarks/theory_pictures.py`` prints and draws them.

Each function returns series of points with 95% confidence intervals and what theory says there; docs/lab tells what
each experiment is, and tests/lab/test_theory.py asserts smaller versions. Two of them are sweeps of examples/lab. The
others need a car that gets its word from outside, or places that are drawn anew for each run.
"""

import io
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
from numpy.typing import NDArray

from motorcade import CONTROL, Followers, Program, led, wait
from motorcade.config.profile import Infrared, Profile, built_in_profile
from motorcade.engine import agents
from motorcade.engine.world import World
from motorcade.lab.plan import Plan
from motorcade.lab.spec import read_sweep
from motorcade.lab.task import run_task
from motorcade.mats import Mat, Physics, Pose, Starts
from motorcade.program.compiler import compile_program
from motorcade.program.files import compile_project
from motorcade.words.infrared import air_us, to_frame

EXAMPLES = Path(__file__).resolve().parent.parent / "examples" / "lab"
CLASSROOM = built_in_profile("classroom")

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Series:
    """Points of one experiment under one condition.

    Attributes:
        key: of its name in TEXTS.
        x, mean, error: places, means, and standard errors of the means.
        theory: what theory says at the places.
        limits: other curves, by the key of the name: what simpler theory says at the places.
    """

    key: str
    x: Floats
    mean: Floats
    error: Floats
    theory: Floats
    limits: dict[str, Floats]

    def beyond(self, share: float, least: float = 0.0) -> Floats:
        """How many standard errors each point is farther from theory than ``share`` of it (at least ``least``)."""
        allowed = np.maximum(share * np.abs(self.theory), least)
        excess: Floats = np.maximum(np.abs(self.mean - self.theory) - allowed, 0.0) / np.maximum(self.error, 1e-12)
        return excess


def series(key: str, x: Sequence[float], samples: Sequence[NDArray[Any]], theory: Floats, **limits: Floats) -> Series:
    """Make a series of the runs' results at each place."""
    mean, error = (np.array(each) for each in zip(*(_mean_of(each) for each in samples), strict=True))
    return Series(key, np.array(x, float), mean, error, theory, limits)


def _mean_of(values: Floats) -> tuple[float, float]:
    return float(np.mean(values)), float(np.std(values, ddof=1) / math.sqrt(len(values)))


def with_infrared(profile: Profile, **values: int) -> Profile:
    infrared: Infrared = replace(profile.infrared, **values)
    return replace(profile, infrared=infrared)


# Sending without listening


SENDERS = 20
LISTENS, SPEAKS = CONTROL.encode(accept_ir=1), CONTROL.encode(accept_ir=1, forward=1)
# How long the air must have been free. It is longer than the time after which the receiver gets its word anew: so it
# never passes on what it heard.
SENSE_MS, RENEWED_MS = 50, 40
PERIODS_MS = (100, 200, 300, 450, 700, 1_000, 1_600, 2_500, 5_000)


def star(tick_ms: int) -> Mat:
    """A receiver with senders around it, each in a sector of its own: walls keep them from hearing each other."""
    turns = [number * math.tau / SENDERS for number in range(SENDERS)]
    poses = [Pose(0.0, 0.0), *(Pose(0.9 * math.cos(turn), 0.9 * math.sin(turn)) for turn in turns)]
    edges = [turn + math.pi / SENDERS for turn in turns]
    walls = [(0.12 * math.cos(a), 0.12 * math.sin(a), 1.5 * math.cos(a), 1.5 * math.sin(a)) for a in edges]
    return Mat("star", Starts.of(poses, [False] * len(poses)), tick_ms, walls=tuple(walls))


def aloha(runs: int = 20, seconds: int = 60, periods_ms: Sequence[int] = PERIODS_MS) -> list[Series]:
    """Throughput by offered load, where a frame may begin at any time, and where it begins at whole half frames."""
    return [_aloha(*setup, runs, seconds, periods_ms) for setup in (("any-time", 1, 210), ("half-frames", 20, 430))]


def _aloha(key: str, tick_ms: int, unit_us: int, runs: int, seconds: int, periods_ms: Sequence[int]) -> Series:
    frame_ms = math.ceil(air_us(to_frame(SPEAKS), unit_us) / 1000)
    loads, received = [], []
    for period_ms in periods_ms:
        profile = with_infrared(CLASSROOM, relay_period_ms=period_ms, sense_ms=SENSE_MS, unit_us=unit_us)
        world = World(star(tick_ms), [], profile, seeds=range(runs))
        world.step()
        words = np.full((runs, world.cars), SPEAKS, "<u4")
        words[:, 0] = LISTENS
        world.begin_words(words.tobytes())
        words[:, 1:] = agents.KEEP
        counts = []
        # The first cycles are not stationary.
        for end_ms in (3 * period_ms, 3 * period_ms + seconds * 1000):
            while world.now_ms < end_ms:
                world.run(RENEWED_MS)
                world.begin_words(words.tobytes())
            counts.append((world.now_ms, world.counts()))
        (begin_ms, before), (end_ms, after) = counts
        share = frame_ms / (end_ms - begin_ms)
        loads.append((after["frames"] - before["frames"]).mean() * share)
        received.append((after["heard"] - before["heard"]) * share)
    load, window = np.array(loads), 2 - tick_ms / frame_ms
    limit = load * np.exp(-window * load)
    return series(
        key, loads, received, load * (1 - window * load / SENDERS) ** (SENDERS - 1), **{f"{key}-limit": limit}
    )


# A word in a cloud of discs


PLACED, SIDE_M, BODY_MM = 400, 8.0, 10
RANGES_MM = (250, 300, 350, 400, 430, 460, 490, 520, 560, 600, 700)
# Quintanilla and Ziff 2007: the filling factor at which discs percolate. A disc has four times as many neighbours.
CRITICAL_NEIGHBOURS = 4 * 1.12808737


def scattered(seed: int) -> Floats:
    """Places at random, none nearer to another than a body."""
    dice, placed = np.random.RandomState(seed), np.empty((0, 2))
    while len(placed) < PLACED:
        place = dice.uniform(0, SIDE_M, 2)
        if not len(placed) or np.hypot(*(placed - place).T).min() > 0.0015 * BODY_MM:
            placed = np.vstack([placed, place])
    return placed


def cluster_share(placed: Floats, range_m: float) -> float:
    """Which share of the others belongs to the first one's cluster of discs."""
    near = np.hypot(*(placed[:, None] - placed).T) <= range_m
    reached = np.zeros(len(placed), bool)
    reached[0] = True
    while True:
        more = near[reached].any(axis=0)
        if more.sum() == reached.sum():
            return float(reached.sum() - 1) / (len(placed) - 1)
        reached = more


def percolation(runs: int = 30, ranges_mm: Sequence[int] = RANGES_MM, drawn: int = 200) -> list[Series]:
    """Which share of the followers gets a word, by how many neighbours a car has.

    Theory is the mean of ``drawn`` other clouds of discs. Errors are from their spread, since few runs have too little
    of it: nearly all leaders may be in the large cluster. The limit is the cluster of the same cloud's leader.
    """
    program = Program([wait(3)], Followers([led(1, 3)], forward=True, tagged=True, dwell_seconds=8))
    image = compile_program(program).image
    clouds, others = [scattered(seed) for seed in range(runs)], [scattered(10_000 + each) for each in range(drawn)]
    shares, theory, same = [], [], []
    for range_mm in ranges_mm:
        # Nobody drives, so small bodies may have a long tick.
        body, slow = replace(CLASSROOM.body, diameter_mm=BODY_MM), (0, 1, 2, 3)
        profile = with_infrared(
            replace(CLASSROOM, body=body, speeds_mm_s=slow, turn_rates_deg_s=slow), range_mm=range_mm
        )
        shares.append(np.array([_informed(cloud, image, profile) for cloud in clouds]))
        theory.append([cluster_share(each, range_mm / 1000) for each in others])
        same.append(np.mean([cluster_share(each, range_mm / 1000) for each in clouds]))
    density = PLACED / SIDE_M**2
    neighbours = [density * math.pi * (range_mm / 1000) ** 2 for range_mm in ranges_mm]
    found = series("word", neighbours, shares, np.mean(theory, axis=1), **{"word-limit": np.array(same)})
    return [replace(found, error=np.std(theory, axis=1, ddof=1) * math.sqrt(1 / runs + 1 / drawn))]


def _informed(placed: Floats, image: bytes, profile: Profile) -> float:
    leads = [number == 0 for number in range(len(placed))]
    starts = Starts(placed[:, 0], placed[:, 1], np.zeros(len(placed)), leads)  # type: ignore[arg-type]
    world = World(Mat("cloud", starts, 20, physics=Physics(line_of_sight=False)), [image], profile, threads=1)
    world.run(24_000)
    return float(np.mean(world.snapshot().word[1:] != 0))


# An epidemic


PEOPLE, INFECTED = 200, 10
BOX_M, REACH_M, FASTEST_MM_S, PERSON_MM = 4.0, 0.1, 1_000, 20
_DRIVES = {"accept_ir": 1, "motor_enable": 1, "motor_direction": 3, "motor_speed": 3, "motor_duration": 3}
IGNORANT = CONTROL.encode(**_DRIVES, avoid_enable=1, avoid_duration=3)
TELLING = CONTROL.encode(**_DRIVES, avoid_enable=1, avoid_duration=3, forward=1)


PERIODS_S = {"rare": 8, "often": 2}


def epidemic(runs: int = 10, keys: Sequence[str] = ("rare", "often"), points: int = 10) -> list[Series]:
    """Which share of wandering cars has a word, by time, where a car tells it rarely, and where it tells it often.

    Times are multiples of the mean time in which a car that tells a word reaches one other.
    """
    return [_epidemic(key, PERIODS_S[key] * 1000, runs, points) for key in keys]


def growth_rate(contacts: float, period_s: float) -> float:
    """The rate of growth where a car meets ``contacts`` others at each telling, after waits from 0 to ``period_s``.

    It solves the equation of Euler and Lotka for these waits, instead of for exponential ones.
    """
    low, high = 1e-9, 2 * contacts / period_s
    for _ in range(100):
        middle = (low + high) / 2
        waits = -math.expm1(-middle * period_s) / (middle * period_s)
        low, high = (middle, high) if contacts * waits / (1 - waits) > 1 else (low, middle)
    return low


def _apart(dice: np.random.RandomState) -> Floats:
    """Places at random in the box, (2, PEOPLE), of bodies that don't touch."""
    places = dice.uniform(0.1, BOX_M - 0.1, (2, PEOPLE))
    while True:
        apart_m = np.hypot(*(places[:, :, None] - places[:, None, :]))
        near = np.flatnonzero((np.triu(apart_m < PERSON_MM / 1000, 1)).any(axis=0))
        if not len(near):
            return places
        places[:, near] = dice.uniform(0.1, BOX_M - 0.1, (2, len(near)))


def _epidemic(key: str, period_ms: int, runs: int, points: int) -> Series:
    dice, around = np.random.RandomState(1), [False] * PEOPLE
    x_m, y_m = _apart(dice)
    starts = Starts(x_m, y_m, dice.uniform(0, math.tau, PEOPLE), around)  # type: ignore[arg-type]
    profile = replace(
        with_infrared(CLASSROOM, range_mm=round(REACH_M * 1000), relay_period_ms=period_ms, sense_ms=1, unit_us=100),
        speeds_mm_s=(0, 100, 200, FASTEST_MM_S),
        turn_rates_deg_s=(0, 30, 60, 360),
        body=replace(CLASSROOM.body, diameter_mm=PERSON_MM),
    )
    mat = Mat("box", starts, 5, (BOX_M, BOX_M), walled=True, physics=Physics(line_of_sight=False))
    world = World(mat, [], profile, seeds=range(runs))
    world.step()
    words = np.full((runs, PEOPLE), IGNORANT, "<u4")
    words[:, :INFECTED] = TELLING
    world.begin_words(words.tobytes())
    contacts = (PEOPLE - 1) * math.pi * REACH_M**2 / BOX_M**2
    simple = 2 * contacts / (period_ms / 1000)
    rate = growth_rate(contacts, period_ms / 1000)
    # Until nearly all have it.
    every_ms = round(7.5 / rate * 1000 / points / 100) * 100
    times_s, shares = [], []
    for _ in range(points):
        for _ in range(every_ms // 100):
            world.run(100)
            if world.now_ms % 2000 < 100:
                # A word lasts for three seconds: whoever has one begins it again.
                world.begin_words(_words(world).tobytes())
        times_s.append(world.now_ms / 1000)
        shares.append((_words(world).reshape(runs, PEOPLE) == TELLING).mean(axis=1))
    scaled = [simple * each for each in times_s]
    return series(key, scaled, shares, logistic(times_s, rate), **{f"{key}-limit": logistic(times_s, simple)})


def _words(world: World) -> NDArray[np.uint32]:
    return np.asarray(world.read_senses())[:, agents.WORD].astype("<u4")


def logistic(times_s: Sequence[float], rate: float) -> Floats:
    return 1 / (1 + (PEOPLE / INFECTED - 1) * np.exp(-rate * np.array(times_s)))


# Sweeps of examples/lab


def rows_of(name: str, seeds: int | None) -> tuple[Plan, dict[str, Floats]]:
    """Run a sweep of examples/lab, with ``seeds`` seeds where they are given; return its columns of numbers."""
    path = EXAMPLES / f"{name}.toml"
    sweep = read_sweep(path)
    sweep = replace(sweep, seeds=range(seeds or len(sweep.seeds)))
    compiled, profile = compile_project((path.parent / sweep.programs[0]).read_bytes(), path.parent / sweep.programs[0])
    plan = Plan(sweep, [(compiled.image, profile)], [None], "")
    tables = [pq.read_table(io.BytesIO(run_task(plan.task(index)))) for index in range(plan.tasks)]
    names = [each for each in tables[0].column_names if each not in ("program", "mat")]
    return plan, {name: np.concatenate([table[name].to_numpy() for table in tables]) for name in names}


RUN_S = 0.5
FAST_M_S = CLASSROOM.speeds_mm_s[3] / 1000


def diffusion(seeds: int | None = None) -> list[Series]:
    """The coefficient of diffusion of a car that wanders for a minute, by the angle of a turn."""
    plan, rows = rows_of("diffusion", seeds)
    seconds, rates = plan.sweep.duration_ms / 1000, rows["profile.turn_rates_deg_s[3]"]
    places = sorted(set(rates.tolist()))
    samples = [rows["moved_m"][rates == rate] ** 2 / (4 * seconds) for rate in places]
    angles = [rate * RUN_S for rate in places]
    theory = [_moved2(math.radians(angle), round(seconds / RUN_S)) / (4 * seconds) for angle in angles]
    # For long times, Lovely and Dahlquist 1975: v²τ / (2 (1 - c)) with runs of one length, c the mean cosine.
    step_m = FAST_M_S * RUN_S
    persistence = [1 / (0.5 - 0.5 * math.cos(math.radians(angle))) for angle in angles]
    limit = np.array([step_m**2 / (4 * RUN_S) * (0.5 + 0.5 * each) for each in persistence])
    return [series("wanders", angles, samples, np.array(theory), **{"wanders-limit": limit})]


def _moved2(angle: float, steps: int) -> float:
    """The mean square distance after some steps, of which half are runs, and half are turns to either side."""
    cosine = 0.5 + 0.5 * math.cos(angle)
    pairs = sum((steps - gap) * cosine ** (gap - 1) for gap in range(1, steps))
    return (FAST_M_S * RUN_S) ** 2 * (steps / 2 + 2 * pairs / 4)


def trickle(seeds: int | None = None) -> list[Series]:
    """How many messages an interval has, by the number of followers, for two shares of lost frames."""
    plan, rows = rows_of("trickle", seeds)
    followers = rows["cars"].astype(int)
    # The first interval begins with a message heard, so no follower sends in it. The leader sends three frames first.
    intervals = plan.sweep.duration_ms // 20_000 - 1
    found = []
    for key, rate in zip(("few-lost", "half-lost"), (0.0033, 0.0214), strict=True):
        lost = 1 - (1 - rate) ** 32
        some, counts = rows["physics.bit_error_rate"] == rate, sorted(set(followers.tolist()))
        samples = [(rows["frames"][some & (followers == count)] - 3 - 1) / intervals for count in counts]
        theory = np.array([messages(count, lost) for count in counts])
        limit = np.log(1 / lost + np.array(counts) * math.log(1 / lost)) / math.log(1 / lost)
        found.append(series(key, counts, samples, theory, **{f"{key}-limit": limit}))
    return found


def messages(followers: int, lost: float) -> float:
    """The mean number of messages in an interval, with the leader's, where a car sends only if it has heard none.

    Cars have their turns in a random order, and each frame is lost at each car with the chance ``lost``. The leader
    sends anyhow, at any place in this order.
    """
    totals = np.zeros(followers + 1)
    for place in range(followers + 1):
        chances = np.zeros(followers + 2)
        chances[0] = 1.0
        sends = lost ** np.arange(followers + 2)
        for turn in range(followers + 1):
            now = np.ones_like(sends) if turn == place else sends
            moved = chances * now
            chances = chances - moved
            chances[1:] += moved[:-1]
        totals[place] = chances @ np.arange(followers + 2)
    return float(totals.mean())


EXPERIMENTS: dict[str, Callable[[], list[Series]]] = {
    "aloha": aloha,
    "percolation": percolation,
    "epidemic": epidemic,
    "diffusion": diffusion,
    "trickle": trickle,
}
