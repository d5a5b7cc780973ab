"""The line for uploads: three Ctrl-C after a silence end the car, and no image does."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.chip_benches import SMALL, bench, board_of
from support.strategies import images


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
def test_three_bytes_of_ctrl_c_and_return_after_a_silence_end_the_car(knock):
    assert ends_at_the_prompt(knock)


def test_bytes_after_the_interrupt_are_left_for_the_prompt():
    a_bench = bench()
    board = board_of(a_bench)
    a_bench.usb.arrive(b"\r\x03\r\x01")
    with pytest.raises(KeyboardInterrupt):
        board.read_serial()
    assert a_bench.usb.read(1) == b"\x01"


@given(images(), st.integers(0, 8))
def test_no_image_and_no_part_of_one_ends_the_car(image, kept):
    assert not ends_at_the_prompt(image[:kept] if kept else image[:400])


@pytest.mark.parametrize("data", [b"\x03", b"\r\x03", b"\r\r\r", b"x\x03\x03\x03", SMALL + b"\x03\x03\x03"])
def test_fewer_or_later_bytes_do_not_end_the_car(data):
    assert not ends_at_the_prompt(data)


def test_ctrl_c_bytes_with_pauses_between_do_not_end_the_car():
    assert not ends_at_the_prompt(b"\x03\x03", byte_us=510_000)
