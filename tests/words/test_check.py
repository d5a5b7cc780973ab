"""An announced image is the only one that a car accepts, whatever the line does to the bytes."""

import zlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.words import check, upload
from support.upload_ends import CHECK_OF_NEW, NEW, NEW_OK, OLD, STARTS_MS, Car, images, pieces, programs


@given(image=images(), held=images(), number=st.integers(0, 255), start_ms=STARTS_MS, data=st.data())
def test_a_car_accepts_the_announced_image(image, held, number, start_ms, data):
    car, checksum = Car(held), zlib.crc32(image)
    taken = [car.take(piece, start_ms) for piece in data.draw(pieces(check.check_request(checksum, number)))]
    answer = b"".join(said for _, said in taken)
    assert check.held_checksum(answer, check.check_words(checksum, number)) == zlib.crc32(held)
    assert car.stored == held
    taken = [car.take(piece, start_ms) for piece in data.draw(pieces(image))]
    assert b"".join(said for _, said in taken) == upload.ok_line(image)
    assert car.stored == image


def test_the_check_request_and_its_answer_are_these_bytes():
    # 2 leader states, 3 follower words, dwell level 0, reserved 254; then 32, 5D, 10, 3A and the number 7 in the
    # reserved bits 9 to 2, beside a one in each byte.
    words = "020301FE 010108CA 01010976 01010842 010108EA 0101081E"
    assert bytes.fromhex(words) == CHECK_OF_NEW
    # zlib's CRC-32 of OLD and of the line up to there.
    beginning = b"OK check=325d103a07 holds=%08x" % zlib.crc32(OLD)
    assert Car(OLD).take(CHECK_OF_NEW, 0) == ([upload.CHECK], beginning + b" sum=%08x\n" % zlib.crc32(beginning))


@given(image=programs.filter(lambda image: image != NEW))
def test_a_car_refuses_another_image_than_the_announced_one(image):
    car = Car(OLD)
    car.take(CHECK_OF_NEW, 0)
    assert car.take(image, 1)[0] == [upload.REFUSED]
    assert car.take(NEW, 400) == ([], b"")  # the rest of what was wrong
    assert car.take(image, 1_000)[0] == [upload.REFUSED]  # the checksum holds until the right image comes
    assert car.take(NEW, 2_000) == ([upload.IMAGE], NEW_OK)
    assert car.stored == NEW


def test_ten_seconds_after_an_announcement_a_car_accepts_any_image():
    car = Car(NEW)
    car.take(CHECK_OF_NEW, 0)
    assert car.take(OLD, 9_999)[0] == [upload.REFUSED]
    assert car.take(OLD, 19_999)[0] == [upload.IMAGE]


def test_what_comes_right_behind_an_image_that_was_announced_is_no_image():
    car = Car(OLD)
    assert car.take(CHECK_OF_NEW + NEW + OLD, 0)[0] == [upload.CHECK, upload.IMAGE]
    assert car.take(OLD, 499) == ([], b"")
    assert car.stored == NEW
    assert car.take(OLD, 999)[0] == [upload.IMAGE]


FAULTS = {"lost": lambda byte: [], "doubled": lambda byte: [byte, byte]} | {
    f"bit {bit}": lambda byte, bit=bit: [byte ^ 1 << bit] for bit in range(8)
}


@pytest.mark.parametrize("at", range(check.CHECK_BYTES))
@pytest.mark.parametrize("fault", FAULTS)
def test_a_check_request_with_a_fault_is_no_image_and_gets_no_answer_that_is_mistaken(at, fault):
    car = Car(OLD)
    kinds, answer = car.take(CHECK_OF_NEW[:at] + bytes(FAULTS[fault](CHECK_OF_NEW[at])) + CHECK_OF_NEW[at + 1 :], 0)
    more, _ = car.take(b"", 500)
    assert upload.IMAGE not in kinds + more
    assert car.stored == OLD
    understood = check.held_checksum(answer, check.check_words(0x325D103A, 7)) is not None
    assert understood == (fault == "doubled" and at == check.CHECK_BYTES - 1)


@given(at=st.integers(0, 60), bit=st.integers(0, 7))
def test_an_answer_with_a_flipped_bit_is_ignored(at, bit):
    line = bytearray(check.ready_line(check.check_words(1, 2), OLD))
    line[at % (len(line) - 1)] ^= 1 << bit
    assert check.held_checksum(bytes(line), check.check_words(1, 2)) is None
