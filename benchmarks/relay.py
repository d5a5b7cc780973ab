"""How words spread from car to car, bare and tagged. Run it with ``python benchmarks/relay.py``.

All cars stand still and pass every word on, with a dwell of 8 s; the engine steps them by 5 ms. The goals are those of
the protocol's section on tagged words. The limit of a chain is its air time: each hop takes one frame, and no wait.

``--pictures FOLDER`` also draws the curves of docs/infrared.md. ``--crowd`` adds the speed of the engine with 100,000
moving cars, for which the machine should be quiet.
"""

import argparse
import math
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numba
import numpy as np
from crowd_scenario import TICK_MS as CROWD_TICK_MS
from crowd_scenario import crowd_mat, programs
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from timing import Contestant, take_turns

sys.path.append(str(Path(__file__).resolve().parents[1]))
from scripts.engine_code import register

from motorcade.config.profile import built_in_profile
from motorcade.engine.events import START
from motorcade.engine.world import World
from motorcade.mats.model import Mat, Physics, Starts
from motorcade.words.formats import CONTROL
from motorcade.words.image import Image, image_words
from motorcade.words.infrared import air_us, check_is_good, parity_is_even, tag_of, tagged_frame, to_frame
from motorcade.words.packing import words_to_bytes

PROFILE = built_in_profile("classroom")
DWELL_MS = 8000
TICK_MS = 5
SLOTS = 16
CHAIN_SLOTS = 120
SEEDS = range(4)
# So that one frame in ten is lost: a flipped bit is nearly always found.
LOSS = 0.1
BIT_ERROR_RATE = 1 - (1 - LOSS) ** (1 / 32)
FOLLOWERS = 1000
HOPS = 5
CHAIN_GOALS = (0.99, 0.97, 0.95, 0.93, 0.91)
FRAMES = 100_000_000
CROWD_CARS, CROWD_WARM_MS, CROWD_TIMED_MS = 100_000, 5_000, 4_000
BYTES_GOAL = 144
WORDS = tuple(CONTROL.encode(accept_ir=1, forward=1, led_which=led, led_duration=2) for led in range(4))


class Spread(NamedTuple):
    """How words spread in a world: a row for each slot, a column for each follower."""

    begun: NDArray[np.int64]  # how often the follower began the slot's word
    lag_ms: NDArray[np.float64]  # when it first did, NaN for never
    frames_a_car_s: float

    @property
    def once(self) -> float:
        return float((self.begun == 1).mean())

    def lag_of_ms(self, share: float) -> float:
        """The time within which this share of those that began a word had begun it."""
        return float(np.nanpercentile(self.lag_ms, share * 100)) if np.isfinite(self.lag_ms).any() else math.nan


def image(words: tuple[int, ...], tagged: int, dwell_ms: int = DWELL_MS) -> bytes:
    """Return an image whose leader stands still and sends ``words``."""
    return words_to_bytes(image_words(Image((0x40000000,), words, PROFILE.dwell_ms.index(dwell_ms), tagged)))


def standing(x_m: Any, y_m: Any, shaded: bool, bit_error_rate: float) -> Mat:
    """Return a mat of cars that stand still; car 0 leads."""
    leads = np.arange(len(x_m)) == 0
    physics = Physics(collisions=False, line_of_sight=shaded, bit_error_rate=bit_error_rate)
    heading: Any = np.zeros(len(x_m))
    return Mat("relay", Starts(x_m, y_m, heading, leads), TICK_MS, physics=physics)


def crowd(shaded: bool) -> Mat:
    """Return a leader in the corner of a square of followers at 0.25 m."""
    side = math.ceil(math.sqrt(FOLLOWERS + 1))
    place = np.arange(FOLLOWERS + 1)
    return standing(place % side * 0.25, place // side * 0.25, shaded, BIT_ERROR_RATE)


def chain() -> Mat:
    """Return a leader and HOPS followers in a row at 0.9 m; each hears its neighbours."""
    return standing(np.arange(HOPS + 1) * 0.9, np.zeros(HOPS + 1), False, 0)


def starts(world: World, duration_ms: int) -> NDArray[np.void]:
    """Run a world and return when which car began which word."""
    parts = []
    while world.now_ms < duration_ms:
        world.run(1000)
        events = world.take_events()
        parts.append(events[events["kind"] == START])
    return np.concatenate(parts)


def spread(mat: Mat, tagged: int, seed: int = 1) -> Spread:
    """Run SLOTS slots and tell how each word spread; the first slot, in which the cars are switched on, is left out."""
    world = World(mat, [image(WORDS, tagged)], PROFILE, seeds=seed, events=True)
    events = starts(world, SLOTS * DWELL_MS)
    begun, lag_ms = np.zeros((SLOTS, world.cars), np.int64), np.full((SLOTS, world.cars), np.nan)
    for slot in range(SLOTS):
        in_time = events[events["t_ms"] >= slot * DWELL_MS]
        if tagged:
            its = in_time[in_time["other"] == slot % 31 + 1]
        else:
            during = in_time[in_time["t_ms"] < (slot + 1) * DWELL_MS]
            its = during[during["word"] == WORDS[slot % len(WORDS)]]
        np.add.at(begun[slot], its["car"], 1)
        cars, first = np.unique(its["car"], return_index=True)
        lag_ms[slot, cars] = its["t_ms"][first] - slot * DWELL_MS
    frames = int(world.counts()["frames"].sum())
    return Spread(begun[1:, 1:], lag_ms[1:, 1:], frames / world.cars / (SLOTS * DWELL_MS / 1000))


def held_shares(tagged: int) -> list[float]:
    """The share of time in which each car of the chain holds the leader's word, from the second slot on."""
    duration_ms, shares = CHAIN_SLOTS * DWELL_MS, np.zeros((len(SEEDS), HOPS))
    for row, seed in enumerate(SEEDS):
        events = starts(World(chain(), [image(WORDS, tagged)], PROFILE, seeds=seed, events=True), duration_ms)
        # The leader's word at each ms, as an index into WORDS; a car's word likewise, -1 for none.
        sent = np.arange(duration_ms) // DWELL_MS % len(WORDS)
        for hop in range(1, HOPS + 1):
            its = events[events["car"] == hop]
            held = np.full(duration_ms, -1)
            for at_ms, word in zip(its["t_ms"].tolist(), its["word"].tolist(), strict=True):
                held[at_ms:] = WORDS.index(word)
            shares[row, hop - 1] = (held == sent)[DWELL_MS:].mean()
    means: list[float] = shares.mean(axis=0).tolist()
    return means


def limit_shares() -> list[float]:
    """The shares that the air time alone allows."""
    frame_ms = float(np.mean([air_us(tagged_frame(word, 1), PROFILE.infrared.unit_us) for word in WORDS])) / 1000
    return [1 - hop * frame_ms / DWELL_MS for hop in range(1, HOPS + 1)]


@numba.njit()
def _wrong_words(frames: int, rate: float, seed: int, tagged: bool) -> int:
    """Flip bits of random frames; how many damaged frames a car that hears such frames takes for good."""
    np.random.seed(seed)
    taken = 0
    at, last = 0, -1
    sent = received = 0
    bits = frames * 32
    while True:
        # The distance of one flipped bit to the next, as in any row of independent bits.
        at += int(math.log(1 - np.random.random()) / math.log(1 - rate)) + 1
        frame = (at - 1) // 32
        if frame != last or at > bits:
            if last >= 0:
                is_bare = received & 0x7FE == 0
                is_good = check_is_good(received) and tag_of(received) > 0 if tagged else is_bare
                taken += 1 if parity_is_even(received) and is_good else 0
            if at > bits:
                return taken
            word = np.random.randint(0, 1 << 21) << 11
            sent = tagged_frame(word, np.random.randint(1, 32)) if tagged else to_frame(word)
            received, last = sent, frame
        received ^= 1 << (at - 1) % 32


def drift_ms(tagged: int) -> int:
    """How much later than its slot a follower's round of one word begins after an hour than at first."""
    dwell_ms, hour_ms = 2000, 3_600_000
    word = CONTROL.encode(accept_ir=1, led_which=1, led_duration=2)
    mat = standing(np.array([0.0, 0.5]), np.zeros(2), False, 0)
    at_ms = starts(World(mat, [image((word,), tagged, dwell_ms)], PROFILE, events=True), hour_ms)["t_ms"]
    return int(at_ms[-1]) - int(at_ms[0]) - (len(at_ms) - 1) * dwell_ms


def crowd_speed() -> tuple[float, float]:
    """How many times as many car-steps a second tagged words allow as bare ones, and the bytes of a car."""
    mat, bare = crowd_mat(CROWD_CARS), programs()
    tagged = [each[:3] + bytes([each[3] | 1]) + each[4:] for each in bare]
    worlds = [World(mat, images, seeds=1) for images in (bare, tagged)]

    def contestant(world: World) -> Contestant:
        def prepare() -> None:
            world.reset()
            world.run(CROWD_WARM_MS)

        return Contestant(CROWD_CARS * CROWD_TIMED_MS / CROWD_TICK_MS, lambda: world.run(CROWD_TIMED_MS), prepare)

    first, second = (contestant(world) for world in worlds)
    take_turns({"bare": first, "tagged": second}, 5, lambda _: None)
    return second.rate / first.rate, worlds[1].nbytes / CROWD_CARS


def at_least(value: float, goal: float) -> str:
    """Return the goal, and whether it is met."""
    return f"≥ {goal:g} {'[green]met[/]' if value >= goal else '[red]missed[/]'}"


def at_most(value: float, goal: float) -> str:
    """Return the goal, and whether it is met."""
    return f"≤ {goal:g} {'[green]met[/]' if value <= goal else '[red]missed[/]'}"


def crowd_rows(spreads: dict[tuple[bool, int], Spread]) -> Iterator[tuple[str, str, str, str]]:
    """Rows about the crowd: what, bare, tagged, goal."""
    for shaded, name, once_goal, lag_goal_s, frames_goal in (
        (False, "open", 0.999, 2.5, 0.25),
        (True, "bodies shade", 0.99, 5.0, 0.4),
    ):
        bare, tagged = spreads[shaded, 0], spreads[shaded, 1]
        lag_s = tagged.lag_of_ms(0.95) / 1000
        yield (
            f"{name}: begun exactly once",
            f"{bare.once:.4f}",
            f"{tagged.once:.4f}",
            at_least(tagged.once, once_goal),
        )
        yield f"{name}: 95% begin within", "–", f"{lag_s:.2f} s", at_most(lag_s, lag_goal_s)
        frames = tagged.frames_a_car_s
        yield (
            f"{name}: frames a car a second",
            f"{bare.frames_a_car_s:.2f}",
            f"{frames:.2f}",
            at_most(frames, frames_goal),
        )


def rows(spreads: dict[tuple[bool, int], Spread], shares: list[list[float]]) -> Iterator[tuple[str, str, str, str]]:
    """All rows but those of the crowd's speed."""
    yield from crowd_rows(spreads)
    limit = limit_shares()
    for hop, (bare, tagged) in enumerate(zip(*shares, strict=True), 1):
        name = f"chain, hop {hop}: holds the leader's word (limit {limit[hop - 1]:.3f})"
        yield name, f"{bare:.3f}", f"{tagged:.3f}", at_least(tagged, CHAIN_GOALS[hop - 1])
    bare_taken, taken = _wrong_words(FRAMES, 1e-3, 1, False), _wrong_words(FRAMES, 1e-3, 1, True)
    yield f"wrong words taken in {FRAMES:.0e} frames at 10⁻³", str(bare_taken), str(taken), at_most(taken, 0)
    frame_ms = air_us(0xFFFFFFFF, PROFILE.infrared.unit_us) / 1000
    drift = drift_ms(1)
    yield (
        "drift of a round of one word, an hour",
        f"{drift_ms(0)} ms",
        f"{drift} ms",
        at_most(abs(drift), frame_ms),
    )


TEXTS = {
    "": ("Seconds since the slot began", "Share of 1,000 followers that run its word", "Hop", "Share of time"),
    ".zh": ("时段开始后的秒数", "1,000 辆跟车中已开始执行的比例", "第几跳", "持有头车码字的时间比例"),
}
CURVES = {
    "": ("tagged", "tagged, bodies shade", "bare", "limit: air time"),
    ".zh": ("带标签", "带标签，车身遮挡", "不带标签", "极限：空中时间"),
}


def draw(folder: Path, spreads: dict[tuple[bool, int], Spread], shares: list[list[float]]) -> None:
    """Draw how words spread in the crowd and along the chain, in each language."""
    import matplotlib as mpl
    from matplotlib import pyplot as plt

    # Text stays text, so every browser shows it in a font of its own; the font used here may lack Chinese.
    warnings.filterwarnings("ignore", message="Glyph")
    mpl.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "motorcade", "font.size": 9, "axes.grid": True})
    at_s = np.linspace(0, DWELL_MS / 1000, 161)
    for suffix, (seconds, begun, hop, share) in TEXTS.items():
        names = CURVES[suffix]
        figure, axes = plt.subplots(figsize=(6.4, 3.2), layout="constrained")
        for name, key, colour in zip(names, ((False, 1), (True, 1), (False, 0)), ("C2", "C0", "C3"), strict=False):
            lag_s = spreads[key].lag_ms.ravel() / 1000
            axes.plot(at_s, [(lag_s <= each).mean() for each in at_s], label=name, color=colour)
        axes.set(xlabel=seconds, ylabel=begun, ylim=(0, 1.02), xlim=(0, DWELL_MS / 1000))
        axes.legend(loc="center right")
        figure.savefig(folder / f"relay-crowd{suffix}.svg", metadata={"Date": None})
        figure, axes = plt.subplots(figsize=(6.4, 3.2), layout="constrained")
        hops = range(1, HOPS + 1)
        for name, values, style in (
            (names[3], limit_shares(), "k:"),
            (names[0], shares[1], "C2o-"),
            (names[2], shares[0], "C3o-"),
        ):
            axes.plot(hops, values, style, label=name)
        axes.set(xlabel=hop, ylabel=share, ylim=(0, 1.02), xticks=list(hops))
        axes.legend(loc="lower left")
        figure.savefig(folder / f"relay-chain{suffix}.svg", metadata={"Date": None})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pictures", type=Path, metavar="FOLDER")
    parser.add_argument("--crowd", action="store_true")
    arguments = parser.parse_args()
    spreads = {(shaded, tagged): spread(crowd(shaded), tagged) for shaded in (False, True) for tagged in (0, 1)}
    shares = [held_shares(0), held_shares(1)]
    table = Table(title="How words spread", title_justify="left")
    for name in ("", "bare", "tagged", "goal"):
        table.add_column(name, justify="left" if not name else "right")
    for row in rows(spreads, shares):
        table.add_row(*row)
    if arguments.crowd:
        ratio, car_bytes = crowd_speed()
        table.add_row(f"{CROWD_CARS:,} moving cars: car-steps a second", "1", f"{ratio:.2f}", at_least(ratio, 1.5))
        table.add_row("memory a car, bytes", "", f"{car_bytes:.0f}", at_most(car_bytes, BYTES_GOAL))
    Console().print(table)
    if arguments.pictures:
        draw(arguments.pictures, spreads, shares)


# It makes the functions of words/infrared.py callable from compiled code.
register()

if __name__ == "__main__":
    main()
