"""The brain and the receiver in C give the integers of Python: on this computer and on emulated ATmega328Ps."""

import ctypes
import re
import subprocess
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scripts.exports.brain_c import brain_c

from motorcade.words import receiver
from motorcade.words.request import car_request
from support.brain_steps import STEPS_OF_A_LINE, sums
from support.upload_ends import BAD_HEADER, BAD_WORD, CHECK_OF_NEW, LAST_TICK, NEW, STARTS_MS, images
from support.waiting import DEADLINE_S

HERE = Path(__file__).parent
CHIP_SEED = 7
# About 100,000, in whole lines; a million in `make soak`.
CHIP_STEPS = settings().max_examples * STEPS_OF_A_LINE
STRICT = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic"]
SANITIZERS = ["-fsanitize=undefined,address", "-fno-sanitize-recover=all"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The exported files beside the program that runs random steps."""
    folder = tmp_path_factory.mktemp("brain")
    for name, text in brain_c().items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "brain_steps.c").write_bytes((HERE / "brain_steps.c").read_bytes())
    return folder


def build(folder, name, compiler, *options):
    command = [str(compiler), *STRICT, *options, "brain_steps.c", "motorcade_brain.c", "-o", name]
    subprocess.run(command, cwd=folder, check=True, timeout=DEADLINE_S)
    return folder / name


@pytest.fixture(scope="module")
def steps(folder, gcc):
    return build(folder, "steps", gcc, "-O1", *SANITIZERS)


@pytest.fixture(scope="module")
def chip(folder, avr_gcc):
    """The same for an ATmega328P."""
    defined = [f"-DSEED={CHIP_SEED}UL", f"-DSTEPS={CHIP_STEPS}UL"]
    return build(folder, "steps.elf", avr_gcc, "-Os", "-mmcu=atmega328p", *defined)


@given(seed=st.integers(1, 2**32 - 1))
def test_random_steps_give_the_same_integers(steps, seed):
    done = subprocess.run([steps, str(seed), str(STEPS_OF_A_LINE)], capture_output=True, encoding="utf-8", check=True)
    assert done.stdout.split() == sums(seed, STEPS_OF_A_LINE)


def test_many_steps_on_an_emulated_chip_give_the_same_integers(chip, simavr):
    command = [str(simavr), "-m", "atmega328p", "-f", "16000000", str(chip)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, encoding="utf-8") as running:
        expected = sums(CHIP_SEED, CHIP_STEPS)
        printed, _ = running.communicate(timeout=1800)
    assert re.findall(r"\b[0-9a-f]{8}(?=\.)", re.sub(r"\x1b\[\d*m", "", printed)) == expected


def test_cxx_takes_the_header(folder, gxx, tmp_path):
    (tmp_path / "a.cpp").write_text('#include "motorcade_brain.h"\nint main() { return MOTORCADE_BRAIN_STILL; }\n')
    command = [gxx, "-std=c++11", *STRICT[1:], "-I", folder, tmp_path / "a.cpp", "-o", tmp_path / "a"]
    subprocess.run(command, check=True, timeout=DEADLINE_S)


# Function by function


@pytest.fixture(scope="module")
def library(folder, gcc):
    # The address sanitizer can't be loaded into Python; `steps` has it.
    undefined = ["-fsanitize=undefined", "-fno-sanitize-recover=all"]
    return ctypes.CDLL(str(build(folder, "steps.so", gcc, "-O1", "-shared", "-fPIC", *undefined)))


def in_c(library):
    """The receiver's functions in C, with the names that they have in `motorcade.words.receiver`."""
    names = ("switch_on", "room", "add", "next_event")
    found = SimpleNamespace(**{name: getattr(library, f"motorcade_receiver_{name}") for name in names})
    found.room.restype, found.next_event.restype = ctypes.c_uint16, ctypes.c_uint8
    return found


def outcomes(functions, r, buffer, arrivals, work_words, now):
    """Every event, with the receiver's memory ``r`` and its buffer then."""
    found, waiting = [], b""
    functions.switch_on(r, len(buffer) // 4)

    def take_events():
        event = receiver.WORKING + 1
        while event > receiver.WORKING:
            event = functions.next_event(r, buffer, work_words, now)
            found.append((event, list(r), bytes(buffer)))

    for data, pause_ms in arrivals:
        now = now + pause_ms & LAST_TICK
        waiting += data
        take_events()
        count = min(functions.room(r, buffer, now), len(waiting))
        at = r[receiver.END]
        buffer[at : at + count] = waiting[:count]
        waiting = waiting[count:]
        if count:
            functions.add(r, count, now)
            take_events()
    return found


REQUESTS = (car_request("b", 7), CHECK_OF_NEW + car_request("a", 1), car_request("a", 1)[:-1] + b"?")
SNIPPETS = st.sampled_from(
    [NEW, NEW[:6], CHECK_OF_NEW, CHECK_OF_NEW + NEW, BAD_HEADER, BAD_WORD, bytes(4), b"\0\0\0\xff", *REQUESTS]
)
ARRIVALS = st.lists(st.tuples(SNIPPETS | images() | st.binary(max_size=40), st.integers(0, 1_500)), max_size=12)


# A request behind a check request fills the buffer, so that it moves to the start.
@example([(CHECK_OF_NEW + car_request("a", 1), 0), (NEW, 0)], 12, 1, 0)
@given(arrivals=ARRIVALS, most_words=st.integers(12, 16), work_words=st.integers(1, 20), start_ms=STARTS_MS)
def test_the_receiver_finds_the_same_in_any_bytes(library, arrivals, most_words, work_words, start_ms):
    size = most_words * 4
    memory = (ctypes.c_uint32 * receiver.SIZE)(), (ctypes.c_uint8 * size)()
    found = outcomes(in_c(library), *memory, arrivals, work_words, start_ms)
    assert found == outcomes(receiver, [0] * receiver.SIZE, bytearray(size), arrivals, work_words, start_ms)
