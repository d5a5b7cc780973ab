"""Words and frames, however their bytes are cut; and the commands that count of those that arrive together."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.drive.wire import (
    SessionError,
    newest_of_each_code,
    pack_frame,
    pack_word,
    take_frames,
    unpack_frame,
)
from motorcade.words.formats import LIGHTS
from support.socketless_car import SocketlessCar, begin, command, receive

words = st.lists(st.integers(0, (1 << 32) - 1), max_size=50)


@given(words)
def test_of_words_that_arrive_together_the_newest_of_each_code_counts(sent: list[int]) -> None:
    newest = [sent[index] for index in newest_of_each_code(sent)]
    assert {word >> 28 for word in newest} == {word >> 28 for word in sent}
    assert len(newest) == len({word >> 28 for word in sent})
    for word in newest:
        assert [each for each in sent if each >> 28 == word >> 28][-1] == word


def test_a_command_counts_though_a_word_of_another_code_came_behind_it() -> None:
    car = SocketlessCar()
    channel, _ = car.commands()
    begin(car, channel, command(90))
    receive(channel, command(10) + command(20) + pack_word(LIGHTS.encode(horn=1)))
    assert car.board.angles == [90, 20]
    assert (channel.session.counts["superseded"], channel.session.counts["no-hardware"]) == (1, 1)


@given(st.lists(st.dictionaries(st.text(max_size=5), st.integers()), max_size=8), st.integers(1, 40))
def test_frames_are_read_however_their_bytes_are_cut(sent: list[dict], size: int) -> None:
    received, found = bytearray(), []
    data = b"".join(map(pack_frame, sent))
    for at in range(0, len(data), size):
        received += data[at : at + size]
        found += [struct.pack(">I", len(text)) + text for text in take_frames(received, 1 << 16)]
    assert found == list(map(pack_frame, sent))


def test_a_frame_may_be_as_long_as_allowed_and_no_longer() -> None:
    frame = pack_frame({"do": "join"})
    most_bytes = len(frame) - 4
    assert len(list(take_frames(bytearray(frame), most_bytes))) == 1
    with pytest.raises(SessionError, match=f"at most {most_bytes - 1} bytes of JSON"):
        list(take_frames(bytearray(frame), most_bytes - 1))


@pytest.mark.parametrize("text", [b"", b"[]", b"{", b"\xff", b'{"a":' * 2000])
def test_a_frame_of_a_car_that_is_no_object_ends_the_connection_by_a_value_error(text: bytes) -> None:
    with pytest.raises(ValueError, match="no object"):
        unpack_frame(text)
