"""The receiver of uploads with little memory, and with little work a call."""

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from motorcade.words import blocks, receiver, upload
from motorcade.words.request import check_request
from support.upload_ends import (
    CHECK_OF_NEW,
    LAST_TICK,
    NEW,
    NEW_OK,
    NO_PROGRAM,
    OLD,
    STARTS_MS,
    ReceivingCar,
    events_of,
    images,
)

LARGEST = bytes.fromhex("FFFF0100") + bytes.fromhex("64800000") * 255 + bytes.fromhex("C0280000") * 255
SNIPPETS = st.sampled_from([NEW, NEW[:6], CHECK_OF_NEW, upload.READBACK_REQUEST, LARGEST, NO_PROGRAM, bytes(5)])
ARRIVALS = st.lists(st.tuples(SNIPPETS | images() | st.binary(max_size=40), st.integers(0, 1_500)), max_size=12)
SMALLEST = receiver.LEAST_WORDS


@given(arrivals=ARRIVALS, start_ms=STARTS_MS, work_words=st.integers(1, 20))
def test_little_work_a_call_changes_no_event(arrivals, start_ms, work_words):
    spread = upload.CarEnd(work_words=work_words)
    events, now_ms = [], start_ms
    for data, pause_ms in arrivals:
        now_ms = now_ms + pause_ms & LAST_TICK
        # As many calls as the whole buffer needs.
        events += events_of(spread, [(data, 0)] + [(b"", 0)] * receiver.MOST_WORDS, now_ms)
    assert events == events_of(upload.CarEnd(), arrivals, start_ms)


@pytest.mark.parametrize("work_words", [1, 16, 100])
def test_no_call_checks_more_words_than_it_may(work_words):
    r, buffer = [0] * receiver.SIZE, bytearray(len(LARGEST))
    receiver.switch_on(r, receiver.MOST_WORDS)
    buffer[:] = LARGEST
    receiver.add(r, len(LARGEST), 0)
    checked = []
    while receiver.next_event(r, buffer, work_words, 0) == receiver.WORKING:
        checked.append(r[receiver.CHECKED])
    assert max(b - a for a, b in zip([4, *checked], checked, strict=False)) == work_words * 4
    assert len(checked) == (510 - 1) // work_words
    assert bytes(buffer[r[receiver.START] :][: r[receiver.LENGTH]]) == LARGEST
    assert upload.ok_line(LARGEST).endswith(f"{r[receiver.CRC]:08x}\n".encode())


@pytest.mark.parametrize("cut", [0, 4])
def test_work_that_silence_interrupts_is_finished_before_the_next_bytes_are_taken(cut):
    end = upload.CarEnd(work_words=10)
    arrivals = [(LARGEST[: len(LARGEST) - cut], 0), (NEW, 500)] + [(b"", 0)] * 60
    first = upload.error_line(f"{upload.CUT_OFF} 2040 bytes") if cut else upload.ok_line(LARGEST)
    assert [event.answer for event in events_of(end, arrivals, 0)] == [first, NEW_OK]


@given(states=st.integers(0, 40), most_words=st.integers(SMALLEST, 40), cut=st.integers(4, 44))
@example(states=SMALLEST, most_words=SMALLEST, cut=4)
@example(states=SMALLEST - 1, most_words=SMALLEST, cut=4)
def test_an_image_larger_than_the_car_holds_is_refused_as_soon_as_its_header_is_there(states, most_words, cut):
    image = bytes([states, 0, 0, 0]) + bytes.fromhex("64800000") * states
    words = len(image) // 4
    car = ReceivingCar(OLD, most_words)
    kinds, answer = car.take(image[:cut], 0)
    if words <= most_words:
        assert upload.REFUSED not in kinds
        return
    line = f"ERR image-too-large most={most_words} words={words}\n".encode()
    assert (kinds, answer, car.stored) == ([upload.REFUSED], line, OLD)
    # The rest of it is ignored; the next image is taken.
    assert car.take(image[cut:], 1) == ([], b"")
    assert car.take(NEW, 501) == ([upload.IMAGE], NEW_OK)


def test_what_comes_while_a_car_works_waits_in_order_and_the_car_asks_for_another_call():
    image = bytes([SMALLEST - 1, 0, 0, 0]) + bytes.fromhex("64800000") * (SMALLEST - 1)
    end = upload.CarEnd(SMALLEST, work_words=1)
    assert end.receive_data(image, 0)
    # The buffer is full of the image that is being checked.
    assert end.receive_data(NEW[:5], 0)
    assert end.receive_data(NEW[5:], 0)
    assert end.next_event() is None
    images = []
    while len(images) < 2:
        assert end.receive_data(b"", 0)
        images += [event.image for event in iter(end.next_event, None)]
    assert images == [image, NEW]
    assert not end.receive_data(b"", 0)


def test_bytes_move_to_the_start_of_a_buffer_that_stays_as_long():
    buffer = bytearray(range(10))
    blocks.move_to_start(buffer, 4, 7)
    assert list(buffer) == [4, 5, 6, 3, 4, 5, 6, 7, 8, 9]


def test_a_refused_image_takes_no_announcement_with_it():
    car = ReceivingCar(OLD, SMALLEST)
    assert car.take(check_request(0x325D103A, 7), 0)[0] == [upload.CHECK]
    assert car.take(LARGEST, 1)[0] == [upload.REFUSED]
    assert car.take(NEW, 600) == ([upload.IMAGE], NEW_OK)


def test_requests_and_images_follow_each_other_through_a_buffer_that_is_nearly_full():
    car = ReceivingCar(OLD, SMALLEST)
    everything = (upload.READBACK_REQUEST + NEW + OLD) * 5 + CHECK_OF_NEW
    for size in range(1, 25):
        pieces = [everything[at : at + size] for at in range(0, len(everything), size)]
        kinds = [kind for piece in pieces for kind in car.take(piece, size * 600)[0]]
        assert kinds == [upload.READBACK, upload.IMAGE, upload.IMAGE] * 5 + [upload.CHECK]
        assert car.stored == OLD
        assert car.take(NEW, size * 600)[0] == [upload.IMAGE]
        assert car.take(b"", size * 600 + 500) == ([], b"")
