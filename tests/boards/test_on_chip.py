"""The parts of a MicroPython car, each on a simulated microcontroller: image, infrared, line, motors, sensors."""

import json

import pytest
from driven_car import Bench
from hypothesis import given
from hypothesis import strategies as st
from simulated.flash import Flash, PowerCut
from simulated.microcontroller import Reset

from motorcade.boards.on_chip import power_on
from motorcade.boards.on_chip.image_file import ImageFile
from motorcade.boards.on_chip.motors import Motor
from motorcade.boards.pins import PinsError, parse_pins
from motorcade.boards.voice_map import VoiceMap
from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.car.brain import VOICE_GO
from motorcade.firmware.bundle import templates
from motorcade.firmware.settings import settings_of
from motorcade.profile import built_in_profile
from motorcade.words.infrared import frame_durations_us, to_frame
from strategies import images

CLASSROOM = built_in_profile("classroom")
SMALL = bytes.fromhex("01000000 64800000")
LARGE = bytes.fromhex("FFFF0100" + "64800000" * 255 + "C0280000" * 255)
MIDDLE = bytes.fromhex("20080200" + "64800000" * 32 + "C0280000" * 8)
EMPTY = bytes(4)
FRAME = to_frame(0xA4A80000)
ESP32 = (templates() / "esp32.toml").read_text(encoding="utf-8")
RP2040 = (templates() / "rp2040.toml").read_text(encoding="utf-8")
VOICE_MAP = VoiceMap(9600, ((b"go", VOICE_GO),))


def bench(is_leader: bool = False, text: str = ESP32, platform: str = "esp32", flash: Flash | None = None) -> Bench:
    return Bench(settings_of(parse_pins(text, "test.toml"), CLASSROOM, is_leader), platform, flash)


def board_of(a_bench: Bench):
    return a_bench.open().board


# The image in the flash


def cuts(flash: Flash, old: bytes | None, new: bytes):
    """What is found after each cut of power while ``new`` replaces ``old``."""
    for steps in range(len(new) + 100):
        flash.files.clear()
        flash.cut_after = None
        store = ImageFile("car.image", flash, flash.open)
        if old is not None:
            flash.files["car.image"] = old
        flash.cut_after = steps
        try:
            store.save(new)
        except PowerCut:
            flash.cut_after = None
            yield store.load()
        else:
            flash.cut_after = None
            assert store.load() == new
            return
    raise AssertionError("the power was never enough")


PAIRS = [(SMALL, MIDDLE), (MIDDLE, SMALL), (EMPTY, SMALL), (None, SMALL), (MIDDLE, MIDDLE[:-4] + EMPTY), (SMALL, LARGE)]


@pytest.mark.parametrize("atomic_rename", [True, False], ids=["littlefs", "FAT"])
@pytest.mark.parametrize(("old", "new"), PAIRS, ids=lambda image: f"{len(image or b'')} bytes")
def test_a_cut_of_power_at_any_byte_leaves_the_old_image_or_the_new_one(atomic_rename, old, new):
    found = list(cuts(Flash(atomic_rename), old, new))
    assert len(found) > len(new)
    assert set(found) <= {old, new}
    assert found[0] == old


def test_after_a_cut_the_next_image_is_stored_all_the_same():
    flash = Flash()
    for _ in cuts(flash, SMALL, LARGE):
        ImageFile("car.image", flash, flash.open).save(LARGE)
        assert ImageFile("car.image", flash, flash.open).load() == LARGE
        break


def test_a_full_flash_keeps_the_old_image_and_room_for_a_smaller_one():
    flash = Flash(room=100)
    store = ImageFile("car.image", flash, flash.open)
    store.save(SMALL)
    with pytest.raises(OSError, match="28"):
        store.save(LARGE)
    assert store.load() == SMALL
    assert list(flash.files) == ["car.image"]
    store.save(EMPTY)
    assert store.load() == EMPTY


@given(images())
def test_every_image_is_loaded_as_it_was_stored(image):
    flash = Flash()
    ImageFile("car.image", flash, flash.open).save(image)
    assert ImageFile("car.image", flash, flash.open).load() == image


# Infrared in


def heard(board, a_bench: Bench, durations_us, tick_ms: int = 5) -> list[int]:
    """The frames that the board finds in marks and spaces that begin now."""
    frames = []
    a_bench.hear(a_bench.chip.now_us, durations_us)
    until_us = a_bench.chip.now_us + sum(durations_us) + 20_000
    while a_bench.chip.now_us < until_us:
        frames += board.received_frames()
        a_bench.clock.sleep_ms(tick_ms)
    return frames + board.received_frames()


def jittered(frame: int, percents: list[int]) -> list[int]:
    return [us * percent // 100 for us, percent in zip(frame_durations_us(frame), percents, strict=True)]


@given(st.integers(0, 0xFFFFFFFF), st.lists(st.integers(78, 122), min_size=67, max_size=67), st.integers(1, 40))
def test_a_frame_is_heard_however_its_edges_jitter(frame, percents, tick_ms):
    a_bench = bench()
    assert heard(board_of(a_bench), a_bench, jittered(frame, percents), tick_ms) == [frame]


@given(st.lists(st.integers(50, 12_000), min_size=1, max_size=99).filter(lambda noise: len(noise) % 2 == 1))
def test_noise_is_dropped_and_the_frame_behind_it_heard(noise_us):
    a_bench = bench()
    board = board_of(a_bench)
    assert heard(board, a_bench, noise_us) == []
    assert heard(board, a_bench, frame_durations_us(FRAME)) == [FRAME]


@pytest.mark.parametrize("cut", [1, 2, 33, 66])
def test_a_frame_that_is_cut_off_is_dropped_and_the_next_one_heard(cut):
    a_bench = bench()
    board = board_of(a_bench)
    whole = frame_durations_us(FRAME)
    assert heard(board, a_bench, whole[: cut - 1 + cut % 2]) == []
    assert heard(board, a_bench, whole) == [FRAME]


def test_a_loop_that_was_away_for_long_loses_what_it_missed_and_hears_the_next_frame():
    a_bench = bench()
    board = board_of(a_bench)
    whole = frame_durations_us(FRAME)
    for number in range(5):
        a_bench.hear(a_bench.chip.now_us + number * 100_000, whole)
    a_bench.clock.sleep_ms(600)
    late = board.received_frames()
    assert late == [FRAME] * 3
    assert heard(board, a_bench, whole) == [FRAME]


def test_interrupts_that_run_late_change_nothing():
    a_bench = bench()
    a_bench.chip.late_us = 200
    assert heard(board_of(a_bench), a_bench, frame_durations_us(FRAME)) == [FRAME]


def test_a_frame_with_a_pulse_too_short_for_its_interrupts_is_dropped_not_guessed():
    a_bench = bench()
    board = board_of(a_bench)
    a_bench.chip.late_us = 200
    durations_us = frame_durations_us(FRAME)
    one = 3
    assert durations_us[one] == 3 * 560
    glitch = [600, 50, durations_us[one] - 650]
    assert heard(board, a_bench, durations_us[:one] + glitch + durations_us[one + 1 :]) == []
    assert heard(board, a_bench, durations_us) == [FRAME]


def test_a_car_that_sent_once_hears_for_ever_after():
    a_bench = bench()
    board = board_of(a_bench)
    board.send_frame(FRAME)
    for _ in range(3):
        a_bench.clock.sleep_ms(300_000)
        assert board.received_frames() == []
    assert heard(board, a_bench, frame_durations_us(FRAME)) == [FRAME]


def test_the_air_is_taken_from_a_frames_first_mark_to_its_last_and_no_longer():
    a_bench = bench()
    board = board_of(a_bench)
    durations_us = frame_durations_us(FRAME)
    a_bench.hear(a_bench.chip.now_us + 10_000, durations_us)
    senses = {}
    while a_bench.chip.now_us < 120_000:
        board.received_frames()
        senses[a_bench.chip.now_us] = board.senses_carrier()
        a_bench.clock.sleep_us(500)
    end_us = 10_000 + sum(durations_us)
    assert senses == {at_us: 10_000 <= at_us < end_us for at_us in senses}


def test_noise_takes_the_air_for_no_longer_than_a_frames_longest_space():
    a_bench = bench()
    board = board_of(a_bench)
    a_bench.hear(0, [300])
    a_bench.clock.sleep_ms(4)
    board.received_frames()
    assert board.senses_carrier()
    a_bench.clock.sleep_ms(2)
    board.received_frames()
    assert not board.senses_carrier()


@pytest.mark.parametrize(("text", "platform"), [(ESP32, "esp32"), (RP2040, "rp2")])
def test_a_car_does_not_hear_itself_and_hears_again_when_it_has_sent(text, platform):
    a_bench = bench(text=text, platform=platform)
    board = board_of(a_bench)
    begin_us = a_bench.chip.now_us
    board.send_frame(FRAME)
    frames = []
    while board.is_sending():
        frames += board.received_frames()
        a_bench.clock.sleep_ms(3)
    lasted_ms = (a_bench.chip.now_us - begin_us) / 1000
    assert 0 <= lasted_ms - sum(frame_durations_us(FRAME)) / 1000 <= 3
    a_bench.clock.sleep_ms(2)
    assert frames + board.received_frames() == []
    assert not board.senses_carrier()
    assert heard(board, a_bench, frame_durations_us(FRAME)) == [FRAME]


# The line that uploads come by


def ends_at_the_prompt(data: bytes, byte_us: int = 87) -> bool:
    a_bench = bench(is_leader=True)
    car = a_bench.open()
    a_bench.clock.sleep_ms(1000)
    a_bench.upload(a_bench.chip.now_us, data, byte_us)
    try:
        for _ in range(400):
            car.tick()
            a_bench.clock.sleep_ms(3)
    except KeyboardInterrupt:
        return True
    return False


@pytest.mark.parametrize("knock", [b"\r\x03\r\x01", b"\x03\x03\x03", b"\r\x03\x03", b"\x03\r\x03\r"])
def test_three_ctrl_c_or_returns_behind_a_silence_end_the_car(knock):
    assert ends_at_the_prompt(knock)


def test_what_comes_behind_the_knock_is_left_for_the_prompt():
    a_bench = bench()
    board = board_of(a_bench)
    a_bench.usb.arrive(b"\r\x03\r\x01")
    with pytest.raises(KeyboardInterrupt):
        board.read_serial()
    assert a_bench.usb.read(1) == b"\x01"


@given(images(), st.integers(0, 8))
def test_no_image_ends_the_car_not_even_cut_off(image, kept):
    assert not ends_at_the_prompt(image[:kept] if kept else image[:400])


@pytest.mark.parametrize("data", [b"\x03", b"\r\x03", b"\r\r\r", b"x\x03\x03\x03", SMALL + b"\x03\x03\x03"])
def test_fewer_or_later_ones_do_not(data):
    assert not ends_at_the_prompt(data)


def test_ctrl_c_apart_by_more_than_the_silence_does_not():
    assert not ends_at_the_prompt(b"\x03\x03", byte_us=510_000)


# Motors and sensors


def power_of(chip, forward, backward) -> int:
    return chip.duties.get(forward, 0) - chip.duties.get(backward, 0)


def test_a_driver_without_enable_has_the_pwm_on_its_direction_pins():
    a_bench = bench()
    motor = Motor(a_bench.machine, {"forward": 2, "backward": 5})
    for duty in (255, 100, 0, -100, -255):
        motor.drive(duty)
        assert power_of(a_bench.chip, 2, 5) == (abs(duty) * 65535 // 255) * (1 if duty >= 0 else -1)


def test_a_motor_changes_its_direction_without_power():
    a_bench = bench()
    board = board_of(a_bench)
    happened = []
    a_bench.chip.listeners.append(lambda *what: happened.append(what))
    board.set_wheels(1, 3)
    board.set_wheels(2, 3)
    left = a_bench.pins["left_motor"]
    levels, power, powers_at_changes = {}, 0, []
    for what, pin, value in happened:
        if what == "level" and pin in left.values():
            levels[pin] = value
            powers_at_changes.append(power)
        if (what, pin) == ("duty", left["enable"]):
            power = value
        assert not levels.get(left["forward"]) or not levels.get(left["backward"])
    assert set(powers_at_changes) == {0}
    assert power == 65535


def distances(a_bench: Bench, asked_for_ms: int) -> list[int]:
    board, found = board_of(a_bench), []
    for _ in range(0, asked_for_ms, 5):
        found.append(board.obstacle_mm())
        a_bench.clock.sleep_ms(5)
    return found


@pytest.mark.parametrize("distance_mm", [30, 150, 399, 1200, 1999])
def test_the_distance_is_right_to_the_millimetre_and_nothing_is_waited_for(distance_mm):
    a_bench = bench()
    a_bench.show_obstacle(0, distance_mm)
    board = board_of(a_bench)
    a_bench.clock.sleep_ms(1)
    begin_us = a_bench.chip.now_us
    assert board.obstacle_mm() == NOTHING_IN_SIGHT_MM
    assert a_bench.chip.now_us - begin_us == 10
    a_bench.clock.sleep_ms(30)
    assert abs(board.obstacle_mm() - distance_mm) <= 1


@pytest.mark.parametrize("distance_mm", [None, 2100])
def test_beyond_its_range_there_is_nothing(distance_mm):
    a_bench = bench()
    a_bench.show_obstacle(0, distance_mm)
    assert set(distances(a_bench, 300)) == {NOTHING_IN_SIGHT_MM}
    assert a_bench.sonar.pings >= 4


def test_an_obstacle_that_goes_is_forgotten_and_an_old_answer_is_none():
    a_bench = bench()
    a_bench.show_obstacle(0, 150)
    a_bench.clock.sleep_ms(1)
    a_bench.show_obstacle(400_000, None)
    found = distances(a_bench, 700)
    assert found[100:] == [NOTHING_IN_SIGHT_MM] * 40
    board = board_of(bench())
    assert board.obstacle_mm() == NOTHING_IN_SIGHT_MM


def test_an_answer_from_before_a_pause_says_nothing():
    a_bench = bench()
    a_bench.show_obstacle(0, 150)
    board = board_of(a_bench)
    a_bench.clock.sleep_ms(1)
    board.obstacle_mm()
    a_bench.clock.sleep_ms(30)
    assert board.obstacle_mm() < 160
    a_bench.show_obstacle(a_bench.chip.now_us, None)
    a_bench.clock.sleep_ms(500)
    assert board.obstacle_mm() == NOTHING_IN_SIGHT_MM


def test_parts_that_are_not_there_find_nothing_and_do_nothing():
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
    assert (board.is_sending(), board.senses_carrier(), board.received_frames()) == (False, False, [])
    assert (board.obstacle_mm(), board.sees_person(), board.heard_voice()) == (NOTHING_IN_SIGHT_MM, False, 0)


# Power on


def test_a_car_runs_until_it_is_stopped_and_then_stands_still_in_the_dark(capsys):
    flash = Flash()
    flash.files["car.image"] = SMALL
    a_bench = bench(is_leader=True, flash=flash)
    lit = []
    a_bench.chip.listeners.append(lambda *what: lit.append(what))
    power_on.start(a_bench.modules, lambda: a_bench.chip.now_us > 500_000)
    assert ("duty", 25, 180 * 257) in lit
    a_bench.observed.look()
    assert a_bench.chip.duties[25] == a_bench.chip.duties[33] == 0
    assert not any(a_bench.chip.levels.get(pin) for pin in (18, 19, 21, 22))
    assert capsys.readouterr().out == ""


def test_a_knock_leaves_the_prompt_with_its_ctrl_c(capsys):
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


def test_a_car_that_fails_stands_still_says_so_and_starts_again(capsys):
    a_bench = bench(is_leader=True)

    def fail():
        raise MemoryError

    with pytest.raises(Reset):
        power_on.start(a_bench.modules, lambda: a_bench.chip.now_us > 100_000 and fail())
    assert "starts again" in capsys.readouterr().out
    assert a_bench.chip.duties[25] == 0


def test_a_car_without_a_number_takes_its_chips():
    first, second = (bench().open().board.number for _ in range(2))
    assert first == second
    a_bench = bench()
    a_bench.machine.unique_id = lambda: b"another"
    assert a_bench.open().board.number != first


# Settings


def refused(text: str, voice=VOICE_MAP) -> str:
    with pytest.raises(PinsError) as problem:
        settings_of(parse_pins(text, "mine.toml"), CLASSROOM, True, voice=voice)
    return str(problem.value)


def test_settings_that_no_chip_can_fulfil_are_refused_in_a_sentence():
    assert "--voice-map" in refused(ESP32 + "[voice]\nreceive = 16\n", voice=None)
    at_17 = ESP32.replace("led_0 = 18", "led_0 = 17")
    assert "GPIO17" in refused(at_17 + "[voice]\nreceive = 16\n")
    assert "no UART" in refused(RP2040 + "[serial]\ntransmit = 9\nreceive = 8\n")
    assert "different UARTs" in refused(RP2040 + "[serial]\ntransmit = 0\nreceive = 9\n")
    assert "the other one" in refused(RP2040 + "[serial]\ntransmit = 8\nreceive = 9\n[voice]\nreceive = 21\n")
    pi = 'format = "motorcade-pins/1"\nname = "Pi"\nchip = "raspberry-pi"\n[pir]\noutput = 5\n'
    assert "Raspberry Pi" in refused(pi)


@pytest.mark.parametrize(("pins", "uart"), [((0, 1), 0), ((4, 5), 1), ((8, 9), 1), ((12, 13), 0), ((16, 17), 0)])
def test_an_rp2040s_pins_lead_to_their_uart(pins, uart):
    bare = 'format = "motorcade-pins/1"\nname = "Bare"\nchip = "rp2040"\n'
    text = bare + f"[serial]\ntransmit = {pins[0]}\nreceive = {pins[1]}\n"
    assert settings_of(parse_pins(text, "bare.toml"), CLASSROOM, True)["uarts"] == {"serial": uart}
