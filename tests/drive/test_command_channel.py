"""The end that takes commands, with bytes cut, joined and made up in any way, and more clients than sessions."""

from contextlib import nullcontext
from itertools import accumulate, pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.drive.channels import MOST_WRONG
from motorcade.drive.session import ControlSession
from motorcade.drive.wire import DriveError
from motorcade.words.formats import DRIVE
from support.socketless_car import Car, command, receive


@given(st.lists(st.integers(0, 180), min_size=1, max_size=40), st.lists(st.integers(1, 11)))
def test_commands_cut_and_joined_in_any_way_are_executed_newest_first_and_never_misread(angles, cuts) -> None:
    car = Car()
    channel, _ = car.commands()
    data, expected, whole = b"".join(map(command, angles)), [], 0
    ends = [end for end in accumulate(cuts) if end < len(data)]
    for begin, end in pairwise([0, *ends, len(data)]):
        receive(channel, data[begin:end])
        if end // 4 > whole:
            whole = end // 4
            expected.append(angles[whole - 1])
    assert car.board.angles == expected
    assert len(expected) + channel.session.counts["superseded"] == len(angles)


def test_of_what_has_gathered_the_end_alone_is_executed() -> None:
    car = Car()
    channel, _ = car.commands()
    receive(channel, command(90))
    receive(channel, command(10) * 5000 + command(20))
    assert car.board.angles == [90, 20]
    assert channel.session.counts["superseded"] == 5000


@pytest.mark.parametrize(("byte_order", "packed"), [("big", "128CB000"), ("little", "00B08C12")])
def test_the_first_seed_word_arrives_in_either_byte_order(byte_order: str, packed: str) -> None:
    car = Car(byte_order)
    channel, _ = car.commands()
    receive(channel, bytes.fromhex(packed))
    assert car.control.telemetry()[1:4] == (40, 1, 150)


@given(st.binary(min_size=1, max_size=5000))
def test_made_up_bytes_are_counted_and_move_nothing_that_is_not_their_command(data: bytes) -> None:
    car = Car()
    driver, _ = car.commands(1)
    receive(driver, command(90, 100))
    channel, _ = car.commands(2)
    receive(channel, data)
    assert car.board.angles == [90]
    assert car.control.telemetry()[:4] == ("moving", 90, 1, 100)


def test_a_client_that_sends_nonsense_only_is_hung_up_on() -> None:
    car = Car()
    channel, line = car.commands()
    receive(channel, command(90))
    for _ in range(MOST_WRONG - 1):
        receive(channel, b"GET ")
    assert line.is_open
    receive(channel, command(91))
    for _ in range(MOST_WRONG):
        receive(channel, b"GET ")
    assert not line.is_open
    told = car.control.telemetry()
    assert (told.refused, told.turned_away, told.driver) == (2 * MOST_WRONG - 1, 1, None)


def test_a_client_that_sends_nonsense_alone_takes_no_place() -> None:
    car = Car()
    for port in range(9):
        receive(car.commands(port)[0], b"GET ")
    channel, line = car.commands(99)
    receive(channel, command(90))
    assert (car.board.angles, line.is_open) == ([90], True)


def test_when_all_places_are_taken_the_longest_silent_client_loses_its_place() -> None:
    car = Car()
    channels = [car.commands(port) for port in range(9)]
    for car.now_ms, (channel, _) in enumerate(channels):
        receive(channel, command(90))
    late, late_line = car.commands(99)
    receive(late, command(91))
    assert not late_line.is_open
    car.now_ms = 5004
    receive(channels[0][0], command(92))
    late, late_line = car.commands(99)
    receive(late, command(93))
    assert late_line.is_open
    assert [line.is_open for _, line in channels] == [True, False] + [True] * 7


@pytest.mark.parametrize(
    ("taken", "newcomer", "gives"),
    [("eeeemmmmm", "e", None), ("eeebmmmmm", "e", "m"), ("eeemmmmmm", "e", "m"), ("eeeeeeeem", "lin", "e")],
)
def test_a_client_gets_a_place_of_one_that_has_two_more_but_not_the_wheel(taken, newcomer, gives) -> None:
    """The sessions of a full car are told by the first letters of their clients; the first one drives."""
    car = Car()
    sessions = [ControlSession(car.control, client, client) for client in taken]
    sessions[0].command(DRIVE.encode(angle=90, direction=1, speed=100))
    for session in sessions:
        session.take_place()
    comes = ControlSession(car.control, newcomer, newcomer)
    with pytest.raises(DriveError, match="9 in all") if gives is None else nullcontext():
        comes.take_place()
    assert [each.client for each in sessions if not each.has_place] == ([gives] if gives else [])
    assert sessions[0].drives
