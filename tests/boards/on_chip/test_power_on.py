"""A MicroPython car from power-on to its end, and what it survives: faults, a babbling line, a loop that hangs."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st
from simulated.flash import Flash
from simulated.microcontroller import Implementation, Reset

from motorcade.boards.on_chip import power_on
from motorcade.boards.on_chip.infrared import InfraredReceiver
from motorcade.boards.on_chip.parts import ImageFile
from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.config.pins import parse_pins
from motorcade.firmware.car_files import settings_of
from motorcade.words.infrared import frame_durations_us
from motorcade.words.request import REQUEST_KINDS, car_request, check_request
from motorcade.words.upload import READBACK_REQUEST, SILENCE_MS
from support.chip_benches import FRAME, RP2040, SMALL, bench, board_of
from support.strategies import CLASSROOM, images


def test_a_stopped_car_switches_its_wheels_and_leds_off(capsys):
    flash = Flash()
    ImageFile("car.image", flash, flash.open).save(SMALL)
    a_bench = bench(is_leader=True, flash=flash)
    lit = []
    a_bench.chip.listeners.append(lambda *what: lit.append(what))
    power_on.start(a_bench.modules, lambda: a_bench.chip.now_us > 500_000)
    assert ("duty", 25, 180 * 257) in lit
    a_bench.observed.look()
    assert a_bench.chip.duties[25] == a_bench.chip.duties[33] == 0
    assert not any(a_bench.chip.levels.get(pin) for pin in (18, 19, 21, 22))
    assert capsys.readouterr().out == ""


def test_an_interrupt_returns_to_a_prompt_that_obeys_ctrl_c(capsys):
    a_bench, characters = bench(is_leader=True), []
    a_bench.chip.at(90_000, lambda: characters.append(a_bench.usb.interrupt_character))
    a_bench.chip.at(100_000, a_bench.usb.arrive, b"\x03\x03\x03")
    power_on.start(a_bench.modules, lambda: a_bench.chip.now_us > 5_000_000)
    assert a_bench.chip.now_us < 200_000
    assert characters == [-1]
    assert a_bench.usb.interrupt_character == 3
    assert "Ctrl-D starts it again" in capsys.readouterr().out


@pytest.mark.parametrize("content", [None, b"", b"{", b"[]", b"{}", json.dumps({"format": "motorcade-car/9"}).encode()])
def test_a_board_without_its_settings_says_how_to_get_them(content, capsys):
    a_bench = bench()
    if content is None:
        del a_bench.flash.files["car.json"]
    else:
        a_bench.flash.files["car.json"] = content
    power_on.start(a_bench.modules, lambda: False)
    assert "install-firmware" in capsys.readouterr().out


def test_a_failing_car_stops_prints_the_error_and_restarts(capsys):
    a_bench = bench(is_leader=True)

    def fail():
        raise MemoryError

    with pytest.raises(Reset):
        power_on.start(a_bench.modules, lambda: a_bench.chip.now_us > 100_000 and fail())
    assert "starts again" in capsys.readouterr().out
    assert a_bench.chip.duties[25] == 0


def test_check_prints_what_is_wrong_with_a_board_and_what_nobody_watched(capsys, monkeypatch):
    a_bench = bench()
    power_on.check(a_bench.modules, wait_ms=a_bench.clock.sleep_ms)
    assert capsys.readouterr().out.startswith("not checked, since check_board was not given")
    monkeypatch.setattr(power_on.MicroPythonBoard, "obstacle_mm", lambda self: None)
    power_on.check(a_bench.modules, wait_ms=a_bench.clock.sleep_ms)
    assert "obstacle_mm" in capsys.readouterr().out


def test_a_car_without_a_number_gets_one_from_its_chip():
    first, second = (bench().open().board.number for _ in range(2))
    assert first == second
    a_bench = bench()
    a_bench.machine.unique_id = lambda: b"another"
    assert a_bench.open().board.number != first


def test_missing_parts_find_nothing_and_do_nothing():
    text = 'format = "motorcade-pins/1"\nname = "Bare"\nchip = "esp32"\n[leds]\nled_2 = 21\n'
    wanted = settings_of(parse_pins(text, "bare.toml"), CLASSROOM, False)
    full = bench()
    board = power_on.open_board(wanted, full.modules)
    board.send_frame(FRAME)
    board.set_wheels(0, 3)
    board.set_led(1)
    assert not any(full.chip.levels.get(pin) for pin in (18, 19, 21, 22, 25, 26, 4))
    board.set_led(2)
    assert full.chip.levels[21] == 1
    assert (board.is_sending(), board.senses_carrier(), board.received_frames()) == (False, False, ())
    assert (board.obstacle_mm(), board.sees_person(), board.heard_voice()) == (NOTHING_IN_SIGHT_MM, False, 0)
    assert board.dark_floor() == 0


WITH_UART = RP2040 + "[serial]\ntransmit = 8\nreceive = 9\n"
EDGES = 1 << 30


def test_a_line_that_never_falls_silent_does_not_hold_the_car():
    a_bench = bench(text=WITH_UART, platform="rp2")
    board = board_of(a_bench)
    a_bench.upload(0, bytes(range(256)) * 5)
    a_bench.clock.sleep_ms(100)
    begin_us = a_bench.chip.now_us
    assert len(board.read_serial()) > 40
    assert a_bench.chip.now_us - begin_us < 1000


def test_a_follower_hears_after_any_number_of_edges():
    clock_us = [0]
    receiver = InfraredReceiver(lambda: clock_us[0], 560)

    def hear() -> list[int]:
        level, found = 0, []
        for duration_us in [*frame_durations_us(FRAME), 5000]:
            receiver.take_edge(clock_us[0], level)
            clock_us[0] = (clock_us[0] + duration_us) & EDGES - 1
            level = 1 - level
        found += receiver.received_frames()
        return found

    assert hear() == [FRAME]
    largest = 0
    for _ in range(50):
        assert hear() == [FRAME]
        counters = {name: value for name, value in vars(receiver).items() if type(value) is int and "us" not in name}
        largest = max(largest, *counters.values())
    # An integer that grows with the edges would leave MicroPython's small integers one day.
    assert largest <= 1024


def test_a_loop_that_hangs_is_reset():
    a_bench = bench(is_leader=True)
    board = board_of(a_bench)
    loop = power_on.Loop(board, a_bench.modules)
    for _ in range(3000):
        loop.turn()
    with pytest.raises(Reset):
        a_bench.clock.sleep_ms(2001)


@pytest.mark.parametrize(("text", "platform"), [(None, "esp32"), (RP2040, "rp2")])
def test_the_watchdog_lets_somebody_work_at_the_prompt(text, platform):
    a_bench = bench(is_leader=True, platform=platform, **({"text": text} if text else {}))
    a_bench.chip.at(100_000, a_bench.usb.arrive, b"\x03\x03\x03")
    power_on.start(a_bench.modules, lambda: False)
    a_bench.clock.sleep_ms(3_600_000)


@pytest.mark.parametrize(
    ("version", "is_refused"), [((1, 20, 0, ""), True), ((1, 21, 0, ""), False), ((2, 0, 0), False)]
)
def test_a_micropython_without_what_the_car_needs_is_refused_by_name(version, is_refused, capsys):
    a_bench = bench(is_leader=True)
    modules = a_bench.modules._replace(implementation=Implementation(a_bench.chip, version))
    power_on.start(modules, lambda: True)
    said = capsys.readouterr().out
    assert [each in said for each in ("1.20.0", "1.21.0")] == [is_refused] * 2


def test_an_older_rmt_gets_the_divider_and_a_newer_one_the_resolution():
    from simulated.esp32 import Esp32

    for knows_resolution in (True, False):
        a_bench = bench()
        chip = Esp32(a_bench.chip, knows_resolution)
        modules = a_bench.modules._replace(chip=chip)
        board = power_on.open_board(a_bench.settings, modules)
        board.send_frame(FRAME)
        assert a_bench.observed.seen[-1][2] == tuple(frame_durations_us(FRAME))


@pytest.mark.parametrize("begins_every_us", [70_000, 600_000])
def test_garbage_is_collected_where_it_costs_no_frame_and_not_during_an_upload(begins_every_us):
    a_bench = bench()
    loop = power_on.Loop(board_of(a_bench), a_bench.modules)
    at_us = []
    collect = a_bench.collector.collect
    a_bench.collector.collect = lambda: (at_us.append(a_bench.chip.now_us), collect())
    for number in range(20_000_000 // begins_every_us):
        a_bench.hear(number * begins_every_us, frame_durations_us(FRAME))
    a_bench.upload(12_500_000, bytes.fromhex("FFFF0100") + bytes(4 * 399), 2000)
    while a_bench.chip.now_us < 20_000_000:
        loop.turn()
    assert 4 <= len(at_us) <= 8
    assert not any(12_500_000 < each < 16_200_000 for each in at_us)
    # Each time right after the edge that begins a header's mark of 9 ms.
    assert all(each % begins_every_us <= 1200 for each in at_us)


def test_a_car_that_hears_nothing_collects_garbage_all_the_same():
    a_bench = bench()
    loop = power_on.Loop(board_of(a_bench), a_bench.modules)
    while a_bench.chip.now_us < 20_000_000:
        loop.turn()
    assert a_bench.collector.collections == 20_000 // power_on.COLLECT_AT_LEAST_MS


# What programs send to a board that runs something: bytes, and after how many ms. Read in the sources of Thonny, Mu,
# ViperIDE, mpremote, rshell and Arduino Lab for MicroPython.
PROGRAMS = {
    "Thonny": [(0, b"\x03"), (50, b"\x01"), (100, b"\x03"), (200, b"\x03")],
    "Mu, its REPL": [(0, b"\x02\x03")],
    "Mu, its files": [(0, b"\x02"), (0, b"\r\x03"), (10, b"\r\x03"), (20, b"\r\x03"), (30, b"\r\x01")],
    "Mu, a program": [(2 * place, bytes([byte])) for place, byte in enumerate(b"\3\3\1\4\3\3")],
    "ViperIDE connects": [(0, b" \r"), (1500, b"\x03")],
    "ViperIDE stops": [(0, b"\r\x03\x03")],
    "mpremote": [(0, b"\r\x03"), (1, b"\r\x01")],
    "an older mpremote": [(0, b"\r\x03\x03"), (1, b"\r\x01")],
    "rshell": [(0, b"\x03"), (0, b"\x03\r"), (500, b"\x03\r")],
    "Arduino Lab": [(0, b"\x03"), (150, b"\r\x03\x02")],
    "a terminal": [(0, b"\x03")],
    "a slow terminal": [(0, b"\r"), (300, b"\x03")],
    "a terminal after Enter": [(0, b"\r\r\r\r\r"), (300, b"\x03")],
}


def ends_at_the_prompt(pieces: list[tuple[int, bytes]], byte_us: int = 87) -> bool:
    """Whether a car ends where each piece of bytes comes so many ms after the first one."""
    a_bench = bench(is_leader=True)
    car = a_bench.open()
    a_bench.clock.sleep_ms(1000)
    begin_us = a_bench.chip.now_us
    for at_ms, data in pieces:
        a_bench.upload(begin_us + at_ms * 1000, data, byte_us)
    end_us = begin_us + pieces[-1][0] * 1000 + 600_000
    try:
        while a_bench.chip.now_us < end_us:
            car.tick()
            a_bench.clock.sleep_ms(7)
    except KeyboardInterrupt:
        return True
    return False


@pytest.mark.parametrize("program", PROGRAMS)
def test_programs_that_ask_for_the_prompt_end_the_car(program):
    assert ends_at_the_prompt(PROGRAMS[program])


def test_bytes_after_the_interrupt_are_left_for_the_prompt():
    a_bench = bench()
    board = board_of(a_bench)
    a_bench.usb.arrive(b"\r\x03\r\x01")
    with pytest.raises(KeyboardInterrupt):
        board.read_serial()
    assert a_bench.usb.read(1) == b"\x01"


KEYS = st.sampled_from(b"\x03\x03\x03\x01\x02\x04\r")


@st.composite
def images_like_keys(draw) -> bytes:
    """Images whose header, and the beginnings of whose words, are the keys that programs send."""
    states, followers = draw(KEYS), draw(KEYS)
    header = bytes([states, followers, draw(st.sampled_from(b"\x01\x02\x04")), draw(st.integers(0, 1))])
    words = [bytes([draw(KEYS), draw(KEYS), draw(st.integers(0, 31)) << 3, 0]) for _ in range(states + followers)]
    return header + b"".join(words)


@st.composite
def cut(draw, uploads) -> list[tuple[int, bytes]]:
    """An upload in pieces that a slow line brings, each so late that the receiver just waits for it."""
    data = draw(uploads)
    # Near its beginning keys are most like it.
    ends = sorted({*draw(st.lists(st.integers(1, min(8, len(data))), min_size=1, max_size=4)), len(data)})
    pieces, at_ms, begin = [], 0, 0
    for end in ends:
        pieces.append((at_ms, data[begin:end]))
        at_ms += 1 + (end - begin) // 8 + draw(st.sampled_from([0, 20, SILENCE_MS - 50]))
        begin = end
    return pieces


REQUESTS = st.one_of(
    st.builds(check_request, st.integers(0, 2**32 - 1), st.integers(0, 255)),
    st.builds(car_request, st.sampled_from(REQUEST_KINDS), st.integers(0, 255)),
    st.just(READBACK_REQUEST),
)


@given(cut(st.one_of(images(), images_like_keys(), REQUESTS)))
def test_no_upload_ends_the_car_however_late_its_pieces_come(pieces):
    assert not ends_at_the_prompt(pieces)


def test_a_loop_that_was_held_up_takes_no_silence_for_one():
    a_bench = bench()
    board = board_of(a_bench)
    a_bench.usb.arrive(b"\x03")
    board.read_serial()
    a_bench.usb.arrive(b"\x03\x01\x00\x03")
    a_bench.clock.sleep_ms(SILENCE_MS + 100)
    assert board.read_serial()


@pytest.mark.parametrize("data", [b"\r\r\r", b"x\x03\x03\x03", SMALL + b"\x03\x03\x03", b"\x01\x04"])
def test_other_bytes_do_not_end_the_car(data):
    assert not ends_at_the_prompt([(0, data)])
