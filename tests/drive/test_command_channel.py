"""The end that takes commands, with bytes cut, joined and made up in any way, and more clients than sessions."""

from contextlib import nullcontext
from itertools import accumulate, pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.drive.session import ControlSession
from motorcade.drive.wire import SessionError
from motorcade.words.formats import DRIVE
from support.socketless_car import SocketlessCar, begin, command, receive


@given(st.lists(st.integers(0, 180), min_size=1, max_size=40), st.lists(st.integers(1, 11)))
def test_commands_cut_and_joined_in_any_way_are_executed_newest_first_and_never_misread(angles, cuts) -> None:
    car = SocketlessCar()
    channel, _ = car.commands()
    begin(car, channel, command(90))
    data, expected, whole = b"".join(map(command, angles)), [90], 0
    ends = [end for end in accumulate(cuts) if end < len(data)]
    for start, end in pairwise([0, *ends, len(data)]):
        receive(channel, data[start:end])
        if end // 4 > whole:
            whole = end // 4
            expected.append(angles[whole - 1])
    assert car.board.angles == expected
    assert len(expected) + channel.session.counts["superseded"] == len(angles) + 1


def test_of_what_has_gathered_the_end_alone_is_executed() -> None:
    car = SocketlessCar()
    channel, _ = car.commands()
    begin(car, channel, command(90))
    receive(channel, command(10) * 5000 + command(20))
    assert car.board.angles == [90, 20]
    assert channel.session.counts["superseded"] == 5000


@pytest.mark.parametrize(("byte_order", "packed"), [("big", "128CB000"), ("little", "00B08C12")])
def test_the_first_seed_word_arrives_in_either_byte_order(byte_order: str, packed: str) -> None:
    car = SocketlessCar(byte_order)
    channel, _ = car.commands()
    begin(car, channel, bytes.fromhex(packed))
    assert car.control.telemetry()[1:4] == (40, 1, 150)


@given(st.binary(min_size=1, max_size=5000))
def test_made_up_bytes_are_counted_and_move_nothing_that_is_not_their_command(data: bytes) -> None:
    car = SocketlessCar()
    driver, _ = car.commands(1)
    begin(car, driver, command(90, 100))
    channel, _ = car.commands(2)
    begin(car, channel, data)
    assert car.board.angles == [90]
    assert car.control.telemetry()[:4] == ("moving", 90, 1, 100)


@pytest.mark.parametrize("cut", range(1, 12))
def test_what_is_no_command_ends_the_connection_and_what_stands_beside_it_is_not_obeyed(cut: int) -> None:
    car = SocketlessCar()
    channel, line = car.commands()
    begin(car, channel, command(90, 100))
    data = command(91, 100) + b"GET " + command(92, 100)
    receive(channel, data[:cut])
    receive(channel, data[cut:])
    assert not line.is_open
    assert set(car.board.angles) <= {90, 91}
    told = car.control.telemetry()
    assert (told.refused, told.turned_away, told.driver, told.speed) == (1, 1, None, 0)
    assert "between its commands" in car.said[-1]


def test_a_client_that_sends_nonsense_alone_takes_no_place() -> None:
    car = SocketlessCar()
    for port in range(9):
        receive(car.commands(port)[0], b"GET ")
    channel, line = car.commands(99)
    begin(car, channel, command(90))
    assert (car.board.angles, line.is_open) == ([90], True)


def test_when_all_places_are_taken_the_longest_silent_client_loses_its_place() -> None:
    car = SocketlessCar()
    channels = [car.commands(port) for port in range(9)]
    for car.now_ms, (channel, _) in enumerate(channels):
        receive(channel, command(90) * 2)
    late, late_line = car.commands(99)
    receive(late, command(91) * 2)
    assert not late_line.is_open
    assert "9 in all" in car.said[-1]
    car.now_ms = 5004
    receive(channels[0][0], command(92))
    late, late_line = car.commands(99)
    receive(late, command(93) * 2)
    assert late_line.is_open
    assert [line.is_open for _, line in channels] == [True, False] + [True] * 7


@pytest.mark.parametrize(
    ("taken", "newcomer", "gives"),
    [("eeeemmmmm", "e", None), ("eeebmmmmm", "e", "m"), ("eeemmmmmm", "e", "m"), ("eeeeeeeem", "lin", "e")],
)
def test_a_client_gets_a_place_of_one_that_has_two_more_but_not_the_wheel(taken, newcomer, gives) -> None:
    """The sessions of a full car are told by the first letters of their clients; the first one drives."""
    car = SocketlessCar()
    sessions = [ControlSession(car.control, f"{client}:{port}", client) for port, client in enumerate(taken)]
    sessions[0].command(DRIVE.encode(angle=90, direction=1, speed=100))
    for session in sessions:
        session.take_place()
    comes = ControlSession(car.control, f"{newcomer}:99", newcomer)
    with pytest.raises(SessionError, match="9 in all") if gives is None else nullcontext():
        comes.take_place()
    assert [each.client for each in sessions if not each.has_place] == ([gives] if gives else [])
    assert sessions[0].drives
