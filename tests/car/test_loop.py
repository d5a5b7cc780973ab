"""The loop of a car on a test board: its clock and its random draws, with ticks at any time."""

from binascii import crc32
from collections import Counter
from unittest.mock import Mock

import pytest

from motorcade import Program, compile_program, forward, led, left, repeat, together, wait, wander
from motorcade.car import brain, decisions
from motorcade.car.loop import Car
from motorcade.words.flow import COUNT, JUMP
from motorcade.words.formats import FLOW, STATE
from motorcade.words.image import Image, image_words
from motorcade.words.packing import words_to_bytes
from motorcade.words.request import NAME, car_request
from motorcade.words.upload import READBACK_REQUEST
from support.mock_board import MockBoard
from support.timelines import Moment

DRIVES, TURNS_LEFT, TURNS_RIGHT = (0, 2), (1, 2), (2, 2)


def drive(image: bytes, tick_ms: int, ticks: int, number: int = 0) -> tuple[list[Moment], MockBoard]:
    """What a car does in each tick, and its board at the end."""
    board = MockBoard(image, number)
    car, shown = Car(board), []
    for tick in range(ticks):
        board.clock_ms = tick * tick_ms
        car.tick()
        shown.append((board.wheels, board.led))
    return shown, board


def wheels(leader: list, tick_ms: int, ticks: int, number: int = 0) -> list[tuple[int, int]]:
    return [moment[0] for moment in drive(compile_program(Program(leader)).image, tick_ms, ticks, number)[0]]


def test_a_car_that_is_switched_on_remembers_nothing() -> None:
    """In C the memory is whatever was there before."""
    used, fresh = [7] * brain.SIZE, [0] * brain.SIZE
    for memory in (used, fresh):
        brain.switch_on(memory, number=3, now=100)
    assert used == fresh


def test_random_numbers_are_those_of_marsaglias_xorshift() -> None:
    """Cars of every kind draw these numbers, and a recorded run is repeated with them."""
    memory = [0] * brain.SIZE
    memory[brain.RANDOM] = 1
    assert [brain.draw(memory) for _ in range(4)] == [270369, 67634689, 2647435461, 307599695]


def test_random_driving_goes_straight_half_of_the_time_and_turns_to_each_side_a_quarter() -> None:
    drawn = Counter(wheels([wander(3)], 500, 4000, number=3))
    assert 1850 <= drawn[DRIVES] <= 2150
    assert 850 <= drawn[TURNS_LEFT] <= 1150
    assert 850 <= drawn[TURNS_RIGHT] <= 1150


def test_each_car_draws_its_own_directions() -> None:
    assert len({tuple(wheels([wander(3)], 500, 20, number)) for number in range(20)}) == 20


@pytest.mark.parametrize("tick_ms", [20, 333, 1750, 4321])
def test_random_driving_is_the_same_whatever_the_tick(tick_ms: int) -> None:
    roams = [wander(3), wander(1), wait(1)]
    shown = wheels(roams, 1, 60_000)[::tick_ms]
    assert {DRIVES, TURNS_LEFT, TURNS_RIGHT} <= set(shown)
    assert wheels(roams, tick_ms, len(shown)) == shown


@pytest.mark.parametrize("tick_ms", [7, 20, 333, 4321])
def test_late_ticks_cost_the_leader_no_time(tick_ms: int) -> None:
    program = Program(
        [forward(3), repeat(2, left(1), together(forward(2), led(1, 1))), wander(2), wait(0)], [led(0, 1), led(1, 1)]
    )
    compiled = compile_program(program)
    shown, prompt = drive(compiled.image, 1, 20_000)
    shown_late, late = drive(compiled.image, tick_ms, 20_000 // tick_ms)
    assert shown_late == shown[::tick_ms][: len(shown_late)]
    states, states_late = (
        [event for event in board.noted if event[1] == "state" and event[0] <= 12_000] for board in (prompt, late)
    )
    assert states_late == states
    frames = [(t_ms, word) for t_ms, kind, word, _ in late.noted if kind == "frame"]
    assert frames
    assert all(word == compiled.words[-2:][t_ms // 1000 % 2] for t_ms, word in frames)


def test_an_image_that_breaks_off_or_cannot_be_stored_leaves_the_old_one(monkeypatch) -> None:
    old, new = (compile_program(Program([forward(seconds)])).image for seconds in (1, 2))
    board = MockBoard(old)
    car = Car(board)

    def answers(coming: bytes) -> bytes:
        """What the car has answered 0.6 s after these bytes."""
        board.coming, board.answers = coming, b""
        car.tick()
        board.clock_ms += 600
        car.tick()
        return board.answers

    for cut in (1, 4, 7):
        assert answers(new[:cut]) == f"ERR cut off after {cut} bytes\n".encode()
    with monkeypatch.context() as full:
        full.setattr(board, "store_image", Mock(side_effect=OSError("disk full")))
        assert answers(new) == b"ERR the image could not be stored\n"
    assert answers(READBACK_REQUEST) == old == board.image
    assert answers(new) == b"OK words=2 crc32=%08x\n" % crc32(new)
    assert answers(READBACK_REQUEST) == new == board.image
    states = [(at_ms, word) for at_ms, kind, word, _ in board.noted if kind == "state"]
    assert {word for at_ms, word in states if at_ms <= 4 * 600} == {int.from_bytes(old[4:], "big")}
    assert states[-1][1] == int.from_bytes(new[4:], "big")


def slow_board(is_leader: bool) -> MockBoard:
    """The board of a slow car that gets an image while another car sends infrared."""
    board = MockBoard(bytes(4), 1, is_leader=is_leader)
    board.words_a_tick = 4
    board.coming, board.carrier = compile_program(Program([forward(2)])).image, True
    return board


@pytest.mark.parametrize(("falls_silent_ms", "stored_ms"), [(200, 300), (5000, 500)])
def test_an_image_that_waits_for_silence_is_neither_stored_nor_acknowledged(falls_silent_ms, stored_ms) -> None:
    """A cut of power leaves the old one until then."""
    board = slow_board(is_leader=False)
    car = Car(board)
    for board.clock_ms in range(0, stored_ms - 20, 5):
        board.carrier = board.clock_ms < falls_silent_ms
        car.tick()
    assert (board.image, board.answers) == (bytes(4), b"")
    for board.clock_ms in range(stored_ms - 20, stored_ms + 60, 5):
        board.carrier = board.clock_ms < falls_silent_ms
        car.tick()
    assert board.image == compile_program(Program([forward(2)])).image
    assert board.answers.startswith(b"OK words=2")


def test_a_slow_leader_stores_no_image_while_it_sends() -> None:
    board = slow_board(is_leader=True)
    car = Car(board)
    for board.clock_ms in range(0, 300, 5):
        board.carrier = board.clock_ms < 200
        car.tick()
        assert not board.carrier or board.image == bytes(4)
    assert board.image == compile_program(Program([forward(2)])).image


class NotingBoard(MockBoard):
    """A leader whose store notes whether the wheels turn meanwhile."""

    def __init__(self, image: bytes) -> None:
        super().__init__(image, 1)
        self.stored: list[tuple[int, int]] = []

    def store_image(self, data: bytes) -> None:
        self.stored.append(self.wheels)

    def store_name(self, name: str) -> None:
        self.stored.append(self.wheels)


def test_the_wheels_stand_while_something_is_stored_and_drive_on_then() -> None:
    """A store on a bad card takes seconds, in which nothing else would stop them."""
    board = NotingBoard(compile_program(Program([forward(3)])).image)
    car = Car(board)
    for board.clock_ms in (0, 4):
        car.tick()
    assert board.wheels == DRIVES
    board.coming = compile_program(Program([forward(2)])).image + car_request(NAME, 1, "ada")
    for board.clock_ms in (8, 12):
        car.tick()
    assert board.stored == [(0, 0), (0, 0)]
    assert board.wheels == DRIVES


def test_a_slow_leader_decides_by_the_image_that_it_runs_while_it_takes_another_one() -> None:
    """A chip takes a new image's words in several ticks, and drives on between them."""
    drives = STATE.encode(forward=1, motor_enable=1, motor_speed=2)
    counts = FLOW.encode(op=COUNT, level=1, value=1)
    old = words_to_bytes(image_words(Image((drives, counts), (), -1, 0, 1)))
    new = words_to_bytes(image_words(Image((counts,) * 200 + (drives, FLOW.encode(op=JUMP, target=200)), (), -1, 0, 1)))
    board = MockBoard(old, 1)
    board.words_a_tick = 48
    car = Car(board)
    for board.clock_ms in range(0, 3000, 5):
        if board.clock_ms == 500:
            board.coming = new
        car.tick()
        assert car.decisions[decisions.WORDS] in (0, len(car.image) - 1)
    assert board.image == new
    assert car.decisions[decisions.COUNTS] == 200
    assert max(detail for _, kind, _, detail in board.noted if kind == "state") == 200
