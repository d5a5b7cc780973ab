"""A Raspberry Pi receives frames at its pin as they were sent; its car sends and obeys them."""

from motorcade.car.loop import Car
from motorcade.words.infrared import frame_durations_us
from support.mock_pi import ENABLED, FORWARD_1_S, RECEIVER, SENSORS, beam, wheels


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
