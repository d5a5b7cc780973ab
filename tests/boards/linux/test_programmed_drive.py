"""A car with a Raspberry Pi that is driven and runs its own image: who has the wheels, and what goes on."""

import math
import os
import sys
import threading

import pytest

from motorcade import Program, compile_program, forward, led, left, right, together
from motorcade.boards.computer import Equipment, HardwareWatchdog
from motorcade.boards.linux.programmed_drive import ProgrammedDrive
from motorcade.boards.linux.raspberry_pi import RaspberryPi
from motorcade.car.arbiter import APPLIED
from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.config.pins import parse_pins
from motorcade.config.profile import levels_of
from motorcade.drive.session import CarControl, ControlSession
from motorcade.drive.wire import SessionError
from motorcade.words.formats import DRIVE, LIGHTS
from motorcade.words.ticks import TICKS_MASK
from motorcade.words.upload import ok_line
from support.mock_pi import (
    DUTIES,
    ENABLED,
    FORWARD_1_S,
    HEAD,
    LEDS,
    LEDS_AT,
    LEFT_MOTOR,
    RIGHT_MOTOR,
    SENSORS,
    STEERED,
    Sender,
    beam,
    pulse_us,
    shown,
    wheels,
)
from support.paced_line import PacedLine
from support.strategies import CLASSROOM
from support.waiting import DEADLINE_S

BENDS_LEFT = DRIVE.encode(angle=135, direction=1, speed=200)
STILL = DRIVE.encode(angle=90, direction=1, speed=0)
BACKS = DRIVE.encode(angle=90, direction=0, speed=70)
TWO_STATES = compile_program(
    Program([together(forward(2, speed=3), led(1, 2)), together(right(2, speed=2), led(3, 2))])
).image
TURNS_LEFT = compile_program(Program([left(3, speed=1)])).image
# The pins of two motors.
ALL_STILL = ((0, 0, 0), (0, 0, 0))
STRAIGHT, TURNING_RIGHT = ((255, 0, 255), (255, 0, 255)), ((255, 0, 34), (0, 255, 34))
TURNING_LEFT, DRIVEN_LEFT = ((0, 255, 17), (255, 0, 17)), ((255, 0, 100), (255, 0, 200))
ONE_LIT, THREE_LIT = (0, 255, 0, 0), (0, 0, 0, 255)


class PinnedCar:
    """A car, its ``control``, and the ``session`` of a driver."""

    def __init__(self, clock, pins, text, image, is_leader, watchdog=None) -> None:
        self.line, self.sender, self.stored, self.events = PacedLine(), Sender(clock), [], []
        self.saving, self.may_save = threading.Event(), threading.Event()
        self.may_save.set()
        self._clock = clock
        # In the middle of a millisecond, so that rounding errors of sums don't matter.
        clock.now_s += 0.0005
        equipment = Equipment(
            is_leader,
            7,
            levels_of(CLASSROOM),
            self.line,
            image,
            self._save,
            observe=lambda *event: self.events.append(event),
            clock_s=clock,
        )
        wiring = parse_pins(HEAD + text, "test.toml")
        self.board = ProgrammedDrive(equipment, wiring, CLASSROOM, pins, self.sender, watchdog)
        self.thread = next(each for each in threading.enumerate() if each.name == "car program")
        self.control = CarControl(self.board, lambda: int(clock() * 1000) & TICKS_MASK, CLASSROOM)
        self.session = ControlSession(self.control, "ada")
        self.go_on()

    def _save(self, data: bytes) -> None:
        self.saving.set()
        assert self.may_save.wait(DEADLINE_S)
        self.stored.append(data)

    def go_on(self, milliseconds: int = 0) -> None:
        """Let time pass, and the car's thread tick at least every 50 ms."""
        while milliseconds >= 0:
            step_ms = min(milliseconds, 50)
            self._clock.now_s += step_ms / 1000
            milliseconds -= step_ms or 1
            self.line.tick()

    @property
    def state(self) -> str:
        return self.control.telemetry().state


@pytest.fixture
def made(clock, pins):
    """Make cars, which are closed at the end."""
    cars = []

    def make(text=ENABLED + LEDS + SENSORS, image=TWO_STATES, is_leader=True, **more) -> PinnedCar:
        cars.append(PinnedCar(clock, pins, text, image, is_leader, **more))
        return cars[-1]

    yield make
    for car in cars:
        car.line.allow(math.inf)
        car.may_save.set()
        car.control.close()


# Program and driver


def test_a_car_stands_still_until_the_driver_starts_its_program(made, pins):
    car = made()
    assert car.state == "ready"
    assert (wheels(pins), shown(pins, LEDS_AT)) == (ALL_STILL, ONE_LIT)
    car.go_on(2000)
    assert (wheels(pins), shown(pins, LEDS_AT)) == (ALL_STILL, THREE_LIT)


def test_a_driver_takes_the_wheels_at_once_and_the_program_goes_on(made, pins):
    car = made()
    car.session.resume_program()
    assert (car.state, wheels(pins)) == ("program", STRAIGHT)
    car.session.command(STILL)
    assert (car.state, wheels(pins)) == ("program", STRAIGHT)
    car.session.command(BENDS_LEFT)
    assert (car.state, wheels(pins)) == ("moving", DRIVEN_LEFT)
    for _ in range(9):
        car.go_on(250)
        car.session.command(BENDS_LEFT)
        assert wheels(pins) == DRIVEN_LEFT
    # By now the program is in its second state.
    assert shown(pins, LEDS_AT) == THREE_LIT
    car.session.resume_program()
    assert (car.state, wheels(pins)) == ("program", TURNING_RIGHT)
    car.go_on(2000)
    assert (wheels(pins), shown(pins, LEDS_AT)) == (STRAIGHT, ONE_LIT)


def test_lights_and_horn_are_pins_that_are_low_at_the_end(made, pins):
    car = made(ENABLED + "[horn]\nsignal = 8\n[head_light]\nsignal = 7\n")
    both = DRIVE.encode(angle=90, direction=1, speed=0), LIGHTS.encode(head_light=1, horn=1)
    assert [car.session.command(word) for word in both] == [APPLIED, APPLIED]
    assert shown(pins, (7, 8)) == (255, 255)
    car.session.stop()
    assert shown(pins, (7, 8)) == (255, 0)
    car.session.leave()
    assert shown(pins, (7, 8)) == (0, 0)


def test_a_car_with_a_servo_runs_its_program_and_is_driven_too(made, pins):
    def now():
        return pulse_us(pins), shown(pins, LEFT_MOTOR)

    car = made(STEERED + DUTIES)
    assert now() == (1500, (0, 0, 0))
    car.session.resume_program()
    assert now() == (1500, (255, 0, 255))
    car.go_on(2000)
    assert now() == (500, (255, 0, 34))
    car.session.command(BENDS_LEFT)
    assert now() == (2000, (255, 0, 200))
    car.session.stop()
    assert now() == (1500, (0, 0, 0))


def test_a_driven_leader_keeps_sending_to_its_followers(made, pins):
    image = bytes.fromhex("01010100 65800000 A4800000")
    car = made(image=image)
    before = len(car.sender.frames)
    for _ in range(8):
        car.session.command(BENDS_LEFT)
        car.go_on(250)
    assert len(car.sender.frames) > before + 5


def test_a_driven_follower_holds_the_words_it_receives(made, clock, pins):
    car = made(is_leader=False, image=None)
    assert car.board.has_program
    car.session.command(BACKS)
    beam(clock, pins, FORWARD_1_S)
    car.go_on()
    assert wheels(pins) == ((0, 255, 70), (0, 255, 70))
    car.session.resume_program()
    assert wheels(pins) == ((255, 0, 102), (255, 0, 102))
    car.go_on(1000)
    assert (car.state, wheels(pins)) == ("program", ALL_STILL)


def test_after_an_emergency_stop_the_program_drives_only_when_started_again(made, pins):
    car = made()
    car.session.resume_program()
    car.session.stop()
    assert (car.state, wheels(pins)) == ("stopped", ALL_STILL)
    car.go_on(2000)
    assert (wheels(pins), shown(pins, LEDS_AT)) == (ALL_STILL, THREE_LIT)
    with pytest.raises(SessionError):
        car.session.resume_program()
    car.session.clear()
    assert wheels(pins) == ALL_STILL
    car.session.resume_program()
    assert wheels(pins) == TURNING_RIGHT


def test_a_silent_driver_does_not_give_the_program_the_wheels(made, pins):
    car = made()
    car.session.resume_program()
    car.session.command(BENDS_LEFT)
    car.go_on(300)
    car.control.beat()
    assert (car.state, wheels(pins)) == ("moving", DRIVEN_LEFT)
    car.go_on(1)
    car.control.beat()
    assert (car.state, wheels(pins)) == ("failsafe", ALL_STILL)
    car.go_on(3000)
    car.control.beat()
    assert wheels(pins) == ALL_STILL


# Uploads


def test_an_upload_while_somebody_drives_is_stored_and_does_not_move_the_wheels(made, pins):
    car = made(image=None)
    assert not car.board.has_program
    with pytest.raises(SessionError, match="no program"):
        car.session.resume_program()
    car.session.command(BENDS_LEFT)
    car.line.sent.append(TURNS_LEFT)
    car.go_on()
    assert car.line.answered == ok_line(TURNS_LEFT)
    assert car.stored == [TURNS_LEFT]
    assert wheels(pins) == DRIVEN_LEFT
    assert car.board.has_program
    car.go_on()
    car.session.resume_program()
    assert wheels(pins) == TURNING_LEFT
    # One without states of the leader's is no program.
    car.line.sent.append(bytes.fromhex("00010100 A4800000"))
    car.go_on()
    assert not car.board.has_program


def test_a_programmed_car_stands_still_while_its_image_is_stored(made, pins):
    car = made()
    car.session.resume_program()
    car.may_save.clear()
    car.line.sent.append(TURNS_LEFT)
    car.line.allow(1)
    assert car.saving.wait(DEADLINE_S)
    assert wheels(pins) == ALL_STILL
    car._clock.now_s += 5
    car.control.beat()
    assert car.state == "program"
    car.may_save.set()
    car.go_on()
    assert wheels(pins) == TURNING_LEFT
    car.control.beat()
    assert (car.state, wheels(pins)) == ("program", TURNING_LEFT)


# Faults


def test_wheels_stop_within_the_watchdogs_time_where_the_program_hangs(made, pins):
    car = made()
    car.session.resume_program()
    # A check every 50 ms: what is 149 ms old at one check is less than 200 ms old at the next.
    car._clock.now_s += 0.149
    car.control.beat()
    assert (car.state, wheels(pins)) == ("program", STRAIGHT)
    car._clock.now_s += 0.05
    car.control.beat()
    assert (car.state, wheels(pins)) == ("failsafe", ALL_STILL)
    assert "stuck for 199 ms" in car.control.telemetry().last_fault
    car.session.resume_program()
    assert (car.state, wheels(pins)) == ("failsafe", ALL_STILL)
    car.go_on()
    car.session.resume_program()
    assert (car.state, wheels(pins)) == ("program", STRAIGHT)


def test_wheels_stop_where_the_program_dies_and_the_driver_drives_on(made, pins):
    car = made()
    car.session.resume_program()
    car.line.problem = ZeroDivisionError("one by none")
    car.line.allow(1)
    car.thread.join(DEADLINE_S)
    assert wheels(pins) == ALL_STILL
    car.control.beat()
    assert car.state == "failsafe"
    assert "ended by ZeroDivisionError: one by none; serve the car anew" in car.control.telemetry().last_fault
    assert car.events[-1][0] == "fault"
    car.session.command(STILL)
    car.session.command(BENDS_LEFT)
    assert wheels(pins) == DRIVEN_LEFT
    car.session.resume_program()
    assert (car.state, wheels(pins)) == ("failsafe", ALL_STILL)


def test_a_part_that_fails_stops_the_programs_wheels_until_it_works_again(made, pins, monkeypatch):
    car = made()
    car.session.resume_program()

    def fail(board, which):
        raise OSError("the LEDs are out")

    with monkeypatch.context() as broken:
        broken.setattr(RaspberryPi, "set_led", fail)
        car.go_on(2000)
        assert wheels(pins) == ALL_STILL
        car.control.beat()
        assert (car.state, car.control.telemetry().last_fault) == ("failsafe", "the LEDs are out")
    car.go_on()
    car.session.resume_program()
    assert (car.state, wheels(pins)) == ("program", TURNING_RIGHT)
    assert [event[3] for event in car.events if event[0] == "fault"] == ["the LEDs are out"]


def test_the_motor_guard_is_called_before_the_program_moves_the_wheels(made, pins):
    car, asked = made(), []
    car.control.wheels.before_moving = lambda: asked.append(wheels(pins))
    car.session.resume_program()
    assert (asked, wheels(pins), car.control.wheels.is_neutral) == ([ALL_STILL], STRAIGHT, False)
    car.session.stop()
    assert car.control.wheels.is_neutral

    def fail():
        raise OSError("the guard is gone")

    car.control.wheels.before_moving = fail
    car.session.clear()
    car.session.resume_program()
    assert (car.state, wheels(pins)) == ("failsafe", ALL_STILL)


# The end


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such watchdog")
def test_a_closed_car_is_in_neutral_and_has_released_its_hardware(made, pins, tmp_path):
    device = tmp_path / "watchdog"
    os.mkfifo(device)
    reader = os.open(device, os.O_RDONLY | os.O_NONBLOCK)
    car = made(watchdog=HardwareWatchdog(device))
    released = [pins.pin(number) for number in (*LEFT_MOTOR, *RIGHT_MOTOR, *LEDS_AT)]
    car.session.resume_program()
    car.control.beat()
    car.line.allow(math.inf)
    car.control.close()
    car.control.close = lambda: None
    assert os.read(reader, 100) == b"\0V"
    os.close(reader)
    assert [(pin.state, pin.function) for pin in released] == [(0, "input")] * 10
    assert pins.pins == {}
    assert car.sender.closed
    assert not car.thread.is_alive()


# The driver's limits


@pytest.mark.parametrize(("parts", "distance_mm"), [(SENSORS, NOTHING_IN_SIGHT_MM), ("", None)])
def test_a_driver_gets_the_distance_of_a_sensor_that_the_pin_file_names(made, parts, distance_mm):
    board = made(ENABLED + parts).board
    assert (board.obstacle_mm(), board.battery_mv()) == (distance_mm, None)
