"""A car with a Raspberry Pi: words change its pins, and its pins and frames change what it does."""

import threading

import pytest
from gpiozero.pins.mock import MockPWMPin

from motorcade import Program, compile_program, forward, led, left, right, together
from motorcade.boards.computer import run
from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.car.check import NOT_CHECKED, check_board
from motorcade.car.loop import Car
from motorcade.errors import Phrase
from motorcade.words.infrared import frame_durations_us
from motorcade.words.upload import ok_line
from support.mock_pi import (
    DUTIES,
    ENABLED,
    FORWARD_1_S,
    LEDS,
    LEDS_AT,
    LEFT_MOTOR,
    RECEIVER,
    SENSORS,
    STEERED,
    beam,
    shown,
    wheels,
)
from support.waiting import DEADLINE_S

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


# A whole car


PARTS = {
    "all parts": ENABLED + LEDS + SENSORS,
    "no sensors": ENABLED + LEDS,
    "drivers without enable": ENABLED.replace("enable = 12\n", "").replace("enable = 13\n", ""),
    "steered": STEERED + DUTIES + "[leds]\nled_2 = 22\n",
}


@pytest.mark.parametrize("parts", PARTS.values(), ids=PARTS)
def test_the_board_keeps_the_contract(car, clock, pins, parts):
    made = car(parts)

    def say(data: bytes) -> None:
        made.line.sent += data

    def hear(frame: int) -> None:
        beam(clock, pins, frame)

    found = check_board(
        made.board, lambda: made.board, clock.wait_ms, hear if SENSORS in parts else None, say, made.observer
    )
    # It stores in a list; ImageStore has a test of its own. A car without a receiver hears nothing.
    left = "observe.cut_power" if SENSORS in parts else "hear, observe.cut_power"
    assert found == [Phrase(NOT_CHECKED, parts=left)]


def test_floor_sensors_may_be_low_over_dark(car, pins):
    board = car(ENABLED + SENSORS.replace("right = 21\n", 'right = 21\ndark = "low"\n')).board
    for first, second, dark in ((0, 0, 3), (1, 0, 2), (0, 1, 1), (1, 1, 0)):
        for number, level in ((20, first), (21, second)):
            (pins.pin(number).drive_high if level else pins.pin(number).drive_low)()
        assert board.dark_floor() == dark


def test_an_uploaded_program_drives_the_pins_and_is_stored(car, clock, pins):
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
def test_a_car_always_ends_in_neutral(car, clock, pins, ends):
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


class Trigger(MockPWMPin):
    """A trigger pin whose sensor gets an echo from an obstacle at ``distance_mm``."""

    def prepare(self, clock, echo, distance_mm):
        self.clock, self.echo, self.distance_mm = clock, echo, distance_mm
        self.pings, self.has_measured = 0, threading.Event()

    def _set_state(self, value):
        super()._set_state(value)
        if not value:
            self.clock.advance(0.0005)
            self.echo.drive_high()
            self.clock.advance(2 * self.distance_mm / 343_260)
            self.echo.drive_low()
            self.pings += 1
            if self.pings == 3:
                self.has_measured.set()


@pytest.mark.parametrize(
    ("distance_mm", "says"),
    [(20, 20), (150, 150), (1200, 1200), (1990, 1990), (2001, NOTHING_IN_SIGHT_MM), (6500, NOTHING_IN_SIGHT_MM)],
)
def test_the_echos_duration_gives_the_distance(car, clock, pins, distance_mm, says):
    trigger = pins.pin(23, pin_class=Trigger)
    trigger.prepare(clock, pins.pin(24), distance_mm)
    board = car(ENABLED + SENSORS).board
    assert trigger.has_measured.wait(DEADLINE_S)
    assert board.obstacle_mm() == pytest.approx(says, abs=1)


def test_a_follower_runs_the_word_of_a_received_frame(car, clock, pins):
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


def test_a_car_ignores_its_own_frame_and_receives_the_next_one(car, clock, pins):
    made = car(ENABLED + SENSORS)
    made.sender.busy = True
    beam(clock, pins, FORWARD_1_S)
    assert made.board.received_frames() == []
    assert made.board.is_sending()
    beam(clock, pins, FORWARD_1_S)
    made.sender.busy, made.sender.ended_s = False, clock.now_s
    clock.now_s += 0.005
    beam(clock, pins, 0x2AAAAAAA)
    assert made.board.received_frames() == [0x2AAAAAAA]


def test_frames_that_overlap_a_cars_own_frame_are_lost(car, clock, pins):
    made = car(ENABLED + SENSORS)
    pin, durations = pins.pin(RECEIVER), frame_durations_us(FORWARD_1_S)

    def play(part: list[int]) -> None:
        for at, duration_us in enumerate(part):
            (pin.drive_high if at % 2 else pin.drive_low)()
            clock.now_s += duration_us / 1e6

    # 20 bits, then the car's own frame, then bits that would complete the 32.
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
