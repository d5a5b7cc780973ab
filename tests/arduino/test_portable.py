"""The library's portable parts as plain C++ on a mock of Arduino's core, against the same parts in Python."""

import binascii
import ctypes
import subprocess
from pathlib import Path

import pytest
from filelock import FileLock
from hypothesis import example, given
from hypothesis import strategies as st
from scripts import debian

from motorcade.boards.on_chip.infrared import InfraredReceiver
from motorcade.car.loop import Car
from motorcade.firmware.arduino_library import library_folder
from motorcade.words.infrared import frame_durations_us, to_frame
from motorcade.words.packing import words_to_bytes
from motorcade.words.request import car_request, check_request
from motorcade.words.upload import READBACK_REQUEST, ok_line
from support.emulated_uploads import image_of
from support.mock_board import MockBoard

HERE = Path(__file__).parent
UNIT_US = 560
MOST_WORDS = 125
# Ticks in which the car stores the largest image, and answers.
TICKS = 120


@pytest.fixture(scope="module")
def plain(install_lock: FileLock, tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    """The portable parts as a library for this computer, with checks for undefined behaviour."""
    with install_lock:
        gxx = debian.find_or_install("g++", *debian.FOR_TESTS["g++"])
    if gxx is None:
        pytest.skip("no g++ (on Debian: apt-get install g++)")
    folder, source = tmp_path_factory.mktemp("plain"), library_folder() / "src"
    flags = ["-O1", "-fPIC", "-Wall", "-Wextra", "-Werror", "-fsanitize=undefined", "-fno-sanitize-recover=all"]
    include = [f"-I{HERE / 'mock'}", f"-I{source}"]
    objects = []
    for file in (*sorted(source.glob("*.c*")), HERE / "probe.cpp"):
        language = ["gcc", "-std=c99"] if file.suffix == ".c" else [str(gxx), "-std=c++11", "-pedantic"]
        objects.append(str(folder / f"{file.name}.o"))
        subprocess.run([*language, *flags, *include, "-c", str(file), "-o", objects[-1]], check=True)
    subprocess.run([str(gxx), "-shared", "-fsanitize=undefined", *objects, "-o", str(folder / "plain.so")], check=True)
    library = ctypes.CDLL(str(folder / "plain.so"))
    for name in ("probe_new", "receiver_new", "line_new"):
        getattr(library, name).restype = ctypes.c_void_p
    library.probe_number.restype = ctypes.c_uint32
    library.line_read.restype = ctypes.c_int16
    library.receiver_next.restype = library.receiver_senses.restype = ctypes.c_uint8
    return library


def pointer(made: int) -> ctypes.c_void_p:
    return ctypes.c_void_p(made)


class Probe:
    """A car of the library; time passes by ``tick``."""

    def __init__(self, library: ctypes.CDLL, is_leader: bool = False, number: int = 1, content: bytes | None = None):
        self.library = library
        self.now_us = 0
        library.set_time(0)
        self.probe = pointer(library.probe_new(is_leader, ctypes.c_uint32(number), content))

    def tick(self, now_ms: int, ticks: int = 1) -> None:
        self.library.set_time(ctypes.c_uint32(now_ms * 1000))
        for _ in range(ticks):
            self.library.probe_tick(self.probe)

    def sent(self) -> bytes:
        data = ctypes.create_string_buffer(1 << 16)
        count = self.library.probe_sent(data)
        return data.raw[:count]

    def memory(self) -> bytes:
        data = ctypes.create_string_buffer(1024)
        self.library.probe_memory(self.probe, data)
        return data.raw

    def close(self) -> None:
        self.library.probe_free(self.probe)


def car_in_python() -> MockBoard:
    """The same leader in Python."""
    board = MockBoard(number=1)
    board.most_words, board.kind = MOST_WORDS, "arduino"
    return board


PIECES = st.one_of(
    st.binary(max_size=30),
    st.just(READBACK_REQUEST),
    st.sampled_from([2, 7, 125, 126, 200]).map(image_of),
    st.sampled_from([2, 30]).map(lambda words: image_of(words)[:-3]),
    st.builds(lambda words, number: check_request(0, number) + image_of(words), st.just(3), st.integers(0, 255)),
    st.builds(lambda seed: _checked(image_of(20, seed)), st.integers(0, 3)),
    st.builds(car_request, st.sampled_from("absgx"), st.integers(0, 255), st.sampled_from(["", "ada"])),
    # A name that no car may have is refused first by the car in Python; nobody sends one.
    st.builds(car_request, st.just("n"), st.integers(0, 255), st.just("ada")),
    st.just(car_request("b", 7)[:30]),
    st.just(bytes(4)),
    st.just(words_to_bytes((0x03000000, 0x64800000, 0x40000001, 0x6B000000))),
)


def _checked(image: bytes) -> bytes:
    return check_request(binascii.crc32(image), 9) + image


@given(st.lists(st.tuples(PIECES, st.sampled_from([1, 20, 499, 500, 1000, 11_000])), max_size=8))
@example([(image_of(125), 600), (READBACK_REQUEST, 600), (image_of(126), 600), (READBACK_REQUEST, 1)])
def test_the_car_answers_any_bytes_as_the_car_in_python_does(plain, script) -> None:
    board = car_in_python()
    car, probe = Car(board), Probe(plain, is_leader=True)
    car.tick()
    for data, gap_ms in [*script, (b"", 600), (READBACK_REQUEST, 0)]:
        board.coming = data
        plain.probe_come(data, len(data))
        for gone_ms, ticks in ((gap_ms, TICKS), (0, 3)):
            for _ in range(ticks):
                car.tick()
            probe.tick(board.clock_ms, ticks)
            board.clock_ms += gone_ms
    assert probe.sent() == board.answers
    probe.close()


@given(
    st.lists(
        st.one_of(
            st.builds(frame_durations_us, st.integers(0, (1 << 32) - 1)),
            st.lists(st.integers(20, 12_000), min_size=1, max_size=9),
        ),
        max_size=5,
    ),
    st.lists(st.floats(0.6, 1.4), min_size=1, max_size=40),
    st.integers(0, 20),
)
def test_edges_become_the_same_frames_as_in_python(plain, pulses, stretches, own) -> None:
    now = [1000]
    python = InfraredReceiver(lambda: now[0], UNIT_US)
    receiver = pointer(plain.receiver_new(UNIT_US))
    # Both begin with the clock at 0 and a level of 1.
    python.take_edge(1000, 1)
    plain.receiver_edge(receiver, 1000, 1)
    level, place, frame = 1, 0, ctypes.c_uint32()
    found, expected = [], []
    for index, durations in enumerate(pulses):
        for duration_us in [*durations, 6000]:
            level = 1 - level
            python.take_edge(now[0], level)
            plain.receiver_edge(receiver, ctypes.c_uint32(now[0]), level)
            if place == own:
                python.ignore_until(now[0] + 40_000)
                plain.receiver_ignore(receiver, ctypes.c_uint32(now[0] + 40_000))
            expected += python.received_frames()
            while plain.receiver_next(receiver, ctypes.c_uint32(now[0]), ctypes.byref(frame)):
                found.append(frame.value)
            # The library drops the lowest bit of a time.
            now[0] += round(duration_us * stretches[place % len(stretches)]) & ~1
            place += 1
            assert bool(plain.receiver_senses(receiver, ctypes.c_uint32(now[0]))) == python.senses_carrier(), index
    assert found == expected
    plain.receiver_free(receiver)


def test_a_frame_is_received_across_the_wrap_of_the_clock(plain) -> None:
    receiver, frame = pointer(plain.receiver_new(UNIT_US)), ctypes.c_uint32()
    now_us, level = (1 << 32) - 30_000, 1
    for duration_us in [*frame_durations_us(to_frame(0xA5A80000)), 0]:
        level = 1 - level
        plain.receiver_edge(receiver, ctypes.c_uint32(now_us), level)
        now_us += duration_us
        came = plain.receiver_next(receiver, ctypes.c_uint32(now_us), ctypes.byref(frame))
    assert came
    assert frame.value == to_frame(0xA5A80000)
    plain.receiver_free(receiver)


@given(st.binary(min_size=1, max_size=30), st.integers(-8, 8), st.sampled_from([1200, 9600, 19200]), st.integers(0, 40))
def test_bytes_of_a_slow_line_come_from_its_edges(plain, data, jitter_us, baud, pause_bits) -> None:
    line = pointer(plain.line_new(baud))
    at_us, level, came = 1_000_000.0, 1, bytearray()
    for byte in data:
        for bit in (0, *(byte >> place & 1 for place in range(8)), 1):
            if bit != level:
                level = bit
                plain.line_edge(line, ctypes.c_uint32(round(at_us) + (jitter_us if level else 0)), level)
            at_us += 1e6 / baud
        at_us += pause_bits * 1e6 / baud
        while (read := plain.line_read(line, ctypes.c_uint32(round(at_us)))) >= 0:
            came.append(read)
    at_us += 20 * 1e6 / baud
    while (read := plain.line_read(line, ctypes.c_uint32(round(at_us)))) >= 0:
        came.append(read)
    assert bytes(came) == data
    plain.line_free(line)


@pytest.mark.parametrize("rooms", [[0], [63, 0, 0, 5], [1]])
def test_a_car_answers_whatever_its_core_says_about_room(plain, rooms) -> None:
    probe = Probe(plain, is_leader=True)
    plain.probe_come(READBACK_REQUEST + image_of(9), 40)
    sent = b""
    for tick in range(300):
        room = rooms[tick % len(rooms)]
        plain.probe_room(room)
        probe.tick(10 + tick)
        came = probe.sent()
        # In a core that always says 0 a byte at a time has to do; where it tells the room, no write waits.
        assert len(came) <= (max(room, 1) if len(rooms) == 1 else room)
        sent += came
    assert sent == bytes(4) + ok_line(image_of(9))
    plain.probe_room(63)
    probe.close()


def test_a_core_without_the_method_gets_a_byte_at_a_time(plain) -> None:
    assert plain.room_without_method() == 1


def test_a_cell_that_keeps_nothing_is_found_and_the_old_image_stays(plain) -> None:
    probe = Probe(plain, is_leader=True)
    for at_ms, data in ((10, image_of(9, 1)), (700, image_of(9, 2))):
        plain.probe_come(data, len(data))
        probe.tick(at_ms, TICKS)
    assert probe.sent().count(b"OK words=9") == 2
    plain.probe_break_cell(probe.probe, 11)
    data = image_of(9, 3)
    plain.probe_come(data, len(data))
    probe.tick(1400, TICKS)
    assert probe.sent() == b"ERR the image could not be stored\n"
    plain.probe_come(READBACK_REQUEST, 4)
    probe.tick(2100, 4)
    assert probe.sent() == image_of(9, 2)
    probe.close()


def test_the_number_of_the_memory_counts_before_the_one_of_the_sketch(plain) -> None:
    probe = Probe(plain, number=7)
    assert plain.probe_number(probe.probe) == 7
    plain.probe_set_number(probe.probe, ctypes.c_uint32(0xFEDCBA98))
    again = Probe(plain, number=7, content=probe.memory())
    assert plain.probe_number(again.probe) == 0xFEDCBA98
    probe.close()
    again.close()


def test_each_kind_of_motor_turns_as_it_should(plain) -> None:
    """An L298 at 7, 8, 5; one with a direction, low for forward, at 9, 6; one that is pulsed at 20, 21."""
    probe = Probe(plain)
    assert plain.level_at(22) == 1  # the driver is awake
    for direction, level, left, right in ((0, 3, 1, 1), (1, 2, -1, 1), (2, 1, 1, -1), (0, 0, 0, 0)):
        plain.probe_wheels(probe.probe, direction, level)
        duty = ((0, 115, 180, 255) if direction == 0 else (0, 100, 150, 200))[level]
        assert (plain.level_at(7), plain.level_at(8), plain.duty_at(5)) == (left > 0, left < 0, duty)
        lower = duty * 80 // 100
        assert plain.duty_at(6) == lower
        if duty:
            assert plain.level_at(9) == (right < 0)
        assert (plain.duty_at(20), plain.duty_at(21)) == ((lower, 0) if right > 0 else (0, lower))
    probe.close()


def test_an_analog_floor_sensor_is_dark_below_its_threshold(plain) -> None:
    """Which is 40% of 1023; a pin of the mock has a quarter of that."""
    probe = Probe(plain)
    for left, right, dark in ((0, 0, 3), (102, 103, 1), (103, 0, 2)):
        plain.set_pin(18, left)
        plain.set_pin(13, right)
        assert plain.probe_floor(probe.probe) == dark
    probe.close()


@pytest.mark.parametrize("rounds", [1, 2, 255, 256, 257, 258])
def test_the_newer_of_two_images_counts_also_where_generations_wrap(plain, rounds) -> None:
    probe = Probe(plain, is_leader=True)
    at_ms = 10
    for number in range(rounds):
        at_ms += 600
        image = image_of(2, number)
        plain.probe_come(image, len(image))
        probe.tick(at_ms, 6)
    again = Probe(plain, is_leader=True, content=probe.memory())
    again.tick(1)
    plain.probe_come(READBACK_REQUEST, 4)
    again.tick(1, 2)
    assert again.sent() == image_of(2, rounds - 1)
    probe.close()
    again.close()
