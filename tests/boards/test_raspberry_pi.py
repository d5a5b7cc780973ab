"""Cars with a Raspberry Pi on gpiozero's mock pins, whose clock the tests set."""

import os
import sys
import threading
from dataclasses import replace
from types import SimpleNamespace

import gpiozero.pins.mock as mock
import pytest
from gpiozero.pins.mock import MockFactory, MockPWMPin

from motorcade import Program, compile_program, forward, led, left, right, together
from motorcade.boards.hardware_watchdog import HardwareWatchdog
from motorcade.boards.linux import Equipment, run
from motorcade.boards.pins import parse_pins
from motorcade.boards.raspberry_pi import RaspberryPi, RaspberryPiDrive
from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.car.check import check_board
from motorcade.car.loop import Car
from motorcade.profile import Motor
from motorcade.sim.levels import levels_of
from motorcade.words.infrared import air_us, frame_durations_us, to_frame
from motorcade.words.upload import ok_line
from strategies import CLASSROOM

DEADLINE_S = 20
HEAD = 'format = "motorcade-pins/1"\nname = "Car"\nchip = "raspberry-pi"\n'
ENABLED = """
[left_motor]
forward = 5
backward = 6
enable = 12
[right_motor]
forward = 16
backward = 26
enable = 13
[duties]
drive = [0, 51, 102, 255]
turn = [0, 17, 34, 85]
"""
LEDS = "[leds]\nled_0 = 17\nled_1 = 27\nled_2 = 22\nled_3 = 10\n"
SENSORS = "[ultrasonic]\ntrigger = 23\necho = 24\n[pir]\noutput = 25\n[infrared]\nreceiver = 4\nsender = 18\n"
STEERED = "[drive_motor]\nforward = 5\nbackward = 6\nenable = 12\n[servo]\nsignal = 19\n"
LEFT_MOTOR, RIGHT_MOTOR = (5, 6, 12), (16, 26, 13)
LEDS_AT = (17, 27, 22, 10)
RECEIVER, PIR = 4, 25
FORWARD_1_S = to_frame(0xE4800000)


class Clock:
    """Seconds that pass only where a test says so."""

    now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


class Line:
    """A line for uploads: bytes to the car, and what it answered."""

    def __init__(self) -> None:
        self.sent = b""
        self.answered = b""

    def read(self) -> bytes:
        data, self.sent = self.sent, b""
        return data

    def write(self, data: bytes) -> None:
        self.answered += data


class Sender:
    """An infrared sender that remembers, and sends for as long as a frame takes, or a test says."""

    ended_s = 0.0
    busy = False
    closed = False

    def __init__(self, clock: Clock) -> None:
        self.frames: list[int] = []
        self._clock = clock

    def send(self, frame: int) -> None:
        self.frames.append(frame)
        self.ended_s = self._clock() + air_us(frame, 560) / 1e6

    def is_sending(self) -> bool:
        return self.busy or self._clock() < self.ended_s

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(mock, "monotonic", clock)
    return clock


@pytest.fixture
def pins(clock):
    factory = MockFactory(pin_class=MockPWMPin)
    yield factory
    factory.close()
    factory.reset()


@pytest.fixture
def car(clock, pins):
    """Makes a car from the text of a pin file: its board, line, sender, and what was stored."""
    boards = []

    def make(text: str, is_leader: bool = False, image: bytes | None = None) -> SimpleNamespace:
        line, sender, stored = Line(), Sender(clock), []
        levels = levels_of(CLASSROOM)
        equipment = Equipment(is_leader, 7, levels, line, image, stored.append, clock_s=clock)
        board = RaspberryPi(equipment, parse_pins(HEAD + text, "test.toml"), CLASSROOM, pins, sender)
        boards.append(board)
        return SimpleNamespace(board=board, line=line, sender=sender, stored=stored)

    yield make
    for board in boards:
        board.close()


@pytest.fixture
def drive(pins):
    """Makes a steered car from its profile."""

    def make(profile=CLASSROOM, **more) -> RaspberryPiDrive:
        return RaspberryPiDrive(parse_pins(HEAD + STEERED, "test.toml"), profile, pins, **more)

    return make


def shown(pins, numbers):
    """What is at the pins: 0 and 1, or a PWM's duty of 255."""
    return tuple(round(pins.pin(number).state * 255, 3) for number in numbers)


def wheels(pins):
    return shown(pins, LEFT_MOTOR), shown(pins, RIGHT_MOTOR)


def pulse_us(pins, pin=19):
    return round(pins.pin(pin).state / pins.pin(pin).frequency * 1e6, 6)


def beam(clock, pins, frame, unit_us=560):
    """Let a frame reach the receiver, which pulls its pin down while there is carrier."""
    pin = pins.pin(RECEIVER)
    for at, duration_us in enumerate(frame_durations_us(frame, unit_us)):
        (pin.drive_high if at % 2 else pin.drive_low)()
        clock.now_s += duration_us / 1e6
    pin.drive_high()


# Wheels and LEDs


@pytest.mark.parametrize(("level", "drives", "turns"), [(0, 0, 0), (1, 51, 17), (2, 102, 34), (3, 255, 85)])
def test_wheels_turn_with_the_duty_of_their_level(car, pins, level, drives, turns):
    board = car(ENABLED).board
    on = 255 if level else 0
    board.set_wheels(0, level)
    assert wheels(pins) == ((on, 0, drives), (on, 0, drives))
    board.set_wheels(1, level)
    assert wheels(pins) == ((0, on, turns), (on, 0, turns))
    board.set_wheels(2, level)
    assert wheels(pins) == ((on, 0, turns), (0, on, turns))
    board.neutral()
    assert wheels(pins) == ((0, 0, 0), (0, 0, 0))


def test_a_driver_without_enable_has_the_duty_on_its_direction_pins(car, pins):
    board = car(ENABLED.replace("enable = 12\n", "").replace("enable = 13\n", "")).board
    board.set_wheels(1, 2)
    assert (shown(pins, (5, 6)), shown(pins, (16, 26))) == ((0, 34), (34, 0))
    board.set_wheels(0, 1)
    assert (shown(pins, (5, 6)), shown(pins, (16, 26))) == ((51, 0), (51, 0))


def test_a_motor_has_no_power_while_its_direction_changes(car, pins):
    board = car(ENABLED).board
    board.set_wheels(1, 3)
    watched = {number: pins.pin(number) for number in LEFT_MOTOR}
    before = {number: len(pin.states) for number, pin in watched.items()}
    board.set_wheels(2, 3)
    assert [round(state.state * 255) for state in watched[12].states[before[12] :]] == [0, 85]


def test_one_led_is_lit_at_a_time_and_none_where_none_is_wanted(car, pins):
    board = car(LEDS).board
    for which in range(4):
        board.set_led(which)
        assert shown(pins, LEDS_AT) == tuple(255 if which == number else 0 for number in range(4))
    board.set_led(4)
    assert shown(pins, LEDS_AT) == (0, 0, 0, 0)


def test_a_car_with_few_parts_does_without_the_others(car, pins):
    board = car("[leds]\nled_2 = 22\n").board
    board.set_wheels(0, 3)
    board.set_led(1)
    assert shown(pins, (22,)) == (0,)
    board.set_led(2)
    assert shown(pins, (22,)) == (255,)
    assert board.obstacle_mm() == NOTHING_IN_SIGHT_MM
    assert not board.sees_person()
    assert board.received_frames() == []
    assert not board.senses_carrier()


# The whole way


@pytest.mark.parametrize("parts", [ENABLED + LEDS + SENSORS, LEDS], ids=["all parts", "LEDs alone"])
def test_the_board_keeps_the_contract(car, clock, pins, parts):
    made = car(parts)

    def wait_ms(milliseconds: int) -> None:
        clock.now_s += milliseconds / 1000

    def say(data: bytes) -> None:
        made.line.sent += data

    hear = (lambda frame: beam(clock, pins, frame)) if parts != LEDS else None
    assert check_board(made.board, wait_ms=wait_ms, hear=hear, say=say) == []


def test_an_uploaded_program_drives_the_pins_and_is_kept(car, clock, pins):
    program = Program([together(forward(2, speed=3), led(1, 1)), left(1, speed=1), right(1, speed=2)])
    image = compile_program(program).image
    made = car(ENABLED + LEDS, is_leader=True)
    loop = Car(made.board)
    made.line.sent = image
    seen = []
    for at_ms in range(4500):
        clock.now_s = 100 + at_ms / 1000
        loop.tick()
        seen.append((wheels(pins), shown(pins, LEDS_AT)))
    assert made.line.answered == ok_line(image)
    assert made.stored == [image]
    dark, lit = (0, 0, 0, 0), (0, 255, 0, 0)
    straight, turns_left = ((255, 0, 255),) * 2, ((0, 255, 17), (255, 0, 17))
    turns_right = ((255, 0, 34), (0, 255, 34))
    assert seen[:1000] == [(straight, lit)] * 1000
    assert seen[1000:2000] == [(straight, dark)] * 1000
    assert seen[2000:3000] == [(turns_left, dark)] * 1000
    assert seen[3000:4000] == [(turns_right, dark)] * 1000
    assert seen[4000:] == [(straight, lit)] * 500


@pytest.mark.parametrize("ends", ["asked to", "by a fault", "by Ctrl-C"])
def test_a_car_ends_in_neutral_however_it_ends(car, clock, pins, ends):
    image = compile_program(Program([together(forward(3, speed=3), led(0, 3))])).image
    made = car(ENABLED + LEDS, is_leader=True, image=image)
    ticks = []

    def wait(seconds):
        clock.now_s += seconds
        ticks.append(wheels(pins))
        if len(ticks) == 10 and ends != "asked to":
            raise KeyboardInterrupt if ends == "by Ctrl-C" else RuntimeError

    left = {
        name: [pins.pin(number) for number in numbers] for name, numbers in (("wheels", LEFT_MOTOR), ("leds", LEDS_AT))
    }
    if ends == "asked to":
        run(made.board, wait, lambda: len(ticks) == 10)
    else:
        with pytest.raises((KeyboardInterrupt, RuntimeError)):
            run(made.board, wait, lambda: False)
    assert ticks[5] == ((255, 0, 255), (255, 0, 255))
    assert [pin.state for name in left for pin in left[name]] == [0] * 7
    assert made.sender.closed


# Sensors


def test_a_person_is_seen_as_long_as_the_sensor_says(car, pins):
    board = car(SENSORS).board
    assert not board.sees_person()
    pins.pin(PIR).drive_high()
    assert board.sees_person()
    pins.pin(PIR).drive_low()
    assert not board.sees_person()


class Trigger(MockPWMPin):
    """The trigger of a sensor whose echo comes back from an obstacle at ``distance_mm``."""

    def prepare(self, clock, echo, distance_mm):
        self.clock, self.echo, self.distance_mm = clock, echo, distance_mm
        self.pings, self.has_measured = 0, threading.Event()

    def _set_state(self, value):
        super()._set_state(value)
        if not value:
            self.clock.now_s += 0.0005
            self.echo.drive_high()
            self.clock.now_s += 2 * self.distance_mm / 343_260
            self.echo.drive_low()
            self.pings += 1
            if self.pings == 3:
                self.has_measured.set()


@pytest.mark.parametrize(
    ("distance_mm", "says"),
    [(20, 20), (150, 150), (1200, 1200), (1990, 1990), (2001, NOTHING_IN_SIGHT_MM), (6500, NOTHING_IN_SIGHT_MM)],
)
def test_the_way_ahead_is_measured_by_the_time_of_its_echo(car, clock, pins, distance_mm, says):
    trigger = pins.pin(23, pin_class=Trigger)
    trigger.prepare(clock, pins.pin(24), distance_mm)
    board = car(SENSORS).board
    assert trigger.has_measured.wait(DEADLINE_S)
    assert board.obstacle_mm() == pytest.approx(says, abs=1)


def test_a_sensor_that_has_measured_nothing_yet_sees_nothing(car):
    assert car(SENSORS).board.obstacle_mm() == NOTHING_IN_SIGHT_MM


# Infrared


def test_a_frame_at_the_receiver_becomes_the_word_that_the_follower_does(car, clock, pins):
    made = car(ENABLED + SENSORS)
    loop = Car(made.board)
    loop.tick()
    beam(clock, pins, FORWARD_1_S)
    loop.tick()
    assert wheels(pins) == ((255, 0, 102), (255, 0, 102))
    clock.now_s += 0.999
    loop.tick()
    assert wheels(pins) == ((255, 0, 102), (255, 0, 102))
    clock.now_s += 0.001
    loop.tick()
    assert wheels(pins) == ((0, 0, 0), (0, 0, 0))


@pytest.mark.parametrize("frame", [0, 0xFFFFFFFF, 0x80000001, FORWARD_1_S, 0x2AAAAAAA])
@pytest.mark.parametrize("unit_us", [450, 560, 680])
def test_frames_are_read_as_they_were_sent_by_slow_and_fast_senders(car, clock, pins, frame, unit_us):
    board = car(SENSORS).board
    board.received_frames()
    clock.now_s += 1
    beam(clock, pins, frame, unit_us)
    clock.now_s += 0.005
    beam(clock, pins, frame, unit_us)
    assert board.received_frames() == [frame, frame]


def test_air_is_busy_from_a_frames_first_mark_to_its_last(car, clock, pins):
    board = car(SENSORS).board
    pin, busy = pins.pin(RECEIVER), []
    clock.now_s += 1
    for at, duration_us in enumerate(frame_durations_us(FORWARD_1_S)):
        (pin.drive_high if at % 2 else pin.drive_low)()
        board.received_frames()
        busy.append(board.senses_carrier())
        clock.now_s += duration_us / 1e6 - 1e-5
        busy.append(board.senses_carrier())
        clock.now_s += 1e-5
    assert all(busy)
    pin.drive_high()
    board.received_frames()
    assert not board.senses_carrier()


def test_noise_makes_the_air_busy_for_no_longer_than_a_frames_space(car, clock, pins):
    board = car(SENSORS).board
    pin = pins.pin(RECEIVER)
    pin.drive_low()
    clock.now_s += 0.0003
    pin.drive_high()
    assert board.received_frames() == []
    assert board.senses_carrier()
    clock.now_s += 0.006
    assert not board.senses_carrier()


def test_a_car_doesnt_hear_itself_but_hears_others_right_behind(car, clock, pins):
    made = car(SENSORS)
    made.sender.busy = True
    beam(clock, pins, FORWARD_1_S)
    assert made.board.received_frames() == []
    assert made.board.is_sending()
    beam(clock, pins, FORWARD_1_S)
    made.sender.busy, made.sender.ended_s = False, clock.now_s
    clock.now_s += 0.005
    beam(clock, pins, 0x2AAAAAAA)
    assert made.board.received_frames() == [0x2AAAAAAA]


def test_what_a_car_misses_while_it_sends_is_made_up_by_nothing(car, clock, pins):
    made = car(SENSORS)
    pin, durations = pins.pin(RECEIVER), frame_durations_us(FORWARD_1_S)

    def play(part: list[int]) -> None:
        for at, duration_us in enumerate(part):
            (pin.drive_high if at % 2 else pin.drive_low)()
            clock.now_s += duration_us / 1e6

    # 20 bits; then the car sends; then what would make them 32.
    play(durations[:42])
    assert made.board.received_frames() == []
    made.sender.busy = True
    play([560, 600])
    assert made.board.received_frames() == []
    made.sender.busy, made.sender.ended_s = False, clock.now_s
    clock.now_s += 0.0011
    play(durations[42:])
    pin.drive_high()
    assert made.board.received_frames() == []


def test_an_edge_that_was_lost_costs_its_frame_alone(car, clock, pins):
    board = car(SENSORS).board
    board.received_frames()
    receiver = board._infrared
    at_s = clock.now_s
    for skipped in (None, 20, None):
        at_s += 0.01
        for number, duration_us in enumerate(frame_durations_us(FORWARD_1_S)):
            if number != skipped:
                receiver.receive_edge(at_s, number % 2 == 0)
            at_s += duration_us / 1e6
        receiver.receive_edge(at_s, False)
    assert board.received_frames() == [FORWARD_1_S, FORWARD_1_S]


def test_a_leader_broadcasts_its_followers_words(car, clock, pins):
    image = bytes.fromhex("00010100 A4800000")
    made = car(SENSORS, is_leader=True, image=image)
    loop = Car(made.board)
    for _ in range(200):
        loop.tick()
        clock.now_s += 0.004
    frame = to_frame(0xA4800000)
    assert set(made.sender.frames) == {frame}
    period_ms = air_us(frame, 560) / 1000 + CLASSROOM.infrared.gap_ms
    assert len(made.sender.frames) == pytest.approx(800 / period_ms, abs=1.5)


# A car that is steered


@pytest.mark.parametrize(
    ("angle_deg", "wanted_us"), [(0, 500), (45, 1000), (90, 1500), (91, 1511.111111), (135, 2000), (180, 2500)]
)
def test_the_servo_gets_the_pulse_of_its_angle(drive, pins, angle_deg, wanted_us):
    board = drive()
    assert (pins.pin(19).frequency, pulse_us(pins)) == (50, 1500)
    board.apply(angle_deg, 1, 0)
    assert pulse_us(pins) == pytest.approx(wanted_us, abs=1e-5)


def test_a_servo_that_is_bent_or_turned_round_goes_by_its_profile(drive, pins):
    bent = replace(CLASSROOM.servo, period_ms=10, pulse_0_deg_us=2400, pulse_90_deg_us=1400, pulse_180_deg_us=600)
    board = drive(replace(CLASSROOM, servo=bent))
    assert pins.pin(19).frequency == 100
    told = []
    for angle_deg in (0, 45, 90, 135, 180):
        board.apply(angle_deg, 1, 0)
        told.append(pulse_us(pins))
    assert told == pytest.approx([2400, 1900, 1400, 1000, 600], abs=1e-5)


@pytest.mark.parametrize("speed", [0, 1, 40, 150, 254, 255])
def test_the_motor_gets_its_duty_either_way(drive, pins, speed):
    board = drive()
    on = 255 if speed else 0
    board.apply(42, 1, speed)
    assert shown(pins, LEFT_MOTOR) == (on, 0, speed)
    board.apply(42, 0, speed)
    assert shown(pins, LEFT_MOTOR) == (0, on, speed)


def test_a_motor_gets_no_more_than_its_profile_allows(drive, pins):
    board = drive(replace(CLASSROOM, motor=Motor(pwm_max=120)))
    board.apply(90, 1, 200)
    assert shown(pins, LEFT_MOTOR) == (255, 0, 120)


def test_neutral_stops_the_wheels_and_centres_the_steering(drive, pins):
    board = drive()
    board.apply(10, 0, 255)
    board.neutral()
    assert (shown(pins, LEFT_MOTOR), pulse_us(pins)) == ((0, 0, 0), 1500)
    assert board.battery_mv() is None
    assert not board.has_program


def test_a_steered_car_is_closed_in_neutral_and_gives_its_pins_back(drive, pins):
    board = drive()
    motor = [pins.pin(number) for number in LEFT_MOTOR]
    board.apply(10, 1, 255)
    board.close()
    assert [(pin.state, pin.function) for pin in motor] == [(0, "input")] * 3
    assert pins.pins == {}


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such watchdog")
def test_a_steered_car_feeds_its_watchdog_and_disarms_it_at_the_end(drive, tmp_path):
    device = tmp_path / "watchdog"
    os.mkfifo(device)
    reader = os.open(device, os.O_RDONLY | os.O_NONBLOCK)
    board = drive(watchdog=HardwareWatchdog(device))
    board.keep_alive()
    assert os.read(reader, 100) == b"\0"
    board.close()
    assert os.read(reader, 100) == b"V"
    os.close(reader)


def test_a_steered_car_without_a_watchdog_says_who_rescues_it(drive):
    rescue = ("motorcade.boards.gpio_chip:pull_low", ("raspberry-pi", "", "5", "6", "12"))
    board = drive(rescue=rescue)
    board.keep_alive()
    assert board.rescue() == rescue
