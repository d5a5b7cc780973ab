"""Both ends of a serial upload, joined in memory, at any pace and in any pieces."""

from binascii import crc32

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from motorcade.errors import Phrase
from motorcade.words import request, upload, uploader
from motorcade.words.image import parse_image_bytes
from support.upload_ends import (
    BAD_HEADER,
    BAD_WORD,
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
    outcome_of,
    pieces,
    programs,
)


def waiting_uploader(now_ms=0):
    end = uploader.UploaderEnd(NEW)
    end.finish_sending(now_ms)
    return end


# Both ends


@given(image=programs, start_ms=STARTS_MS, data=st.data())
def test_an_image_sent_in_any_pieces_is_stored_and_verified(image, start_ms, data):
    car, answers, now_ms = ReceivingCar(OLD), b"", start_ms
    sender = uploader.UploaderEnd(image)
    for piece in data.draw(pieces(image)):
        now_ms = now_ms + data.draw(st.integers(0, 499)) & LAST_TICK
        assert car.stored == OLD
        answers += car.take(piece, now_ms)[1]
    assert car.stored == image
    sender.finish_sending(now_ms)
    for piece in data.draw(pieces(answers)):
        sender.receive_data(piece, now_ms)
    assert sender.outcome.kind == uploader.VERIFIED


@given(image=images(), start_ms=STARTS_MS, data=st.data())
def test_an_image_is_read_back_in_any_pieces(image, start_ms, data):
    car, reader = ReceivingCar(image), uploader.ReadbackEnd(start_ms)
    answer = b"".join(car.take(piece, start_ms)[1] for piece in data.draw(pieces(upload.READBACK_REQUEST)))
    assert car.stored == image
    for piece in data.draw(pieces(answer + b"noise")):
        reader.receive_data(piece, start_ms)
    assert reader.outcome == (upload.IMAGE, image)


# The car's end


@pytest.mark.parametrize("cut", [0, 5, 24, 47])
def test_a_car_takes_no_more_memory_however_much_comes_at_once(cut):
    end = upload.CarEnd(12)
    size = len(end._buffer)
    much = request.check_request(crc32(NEW), 1) * 40 + NEW * 5
    events_of(end, [(much[:cut], 0), (much[cut:], 0), (b"", 600)], 0)
    assert len(end._buffer) == size
    assert [event.answer for event in events_of(end, [(NEW, 0)], 1200)] == [NEW_OK]


@pytest.mark.parametrize(("start_ms", "cut"), [(0, 6), (LAST_TICK - 700, 4), (LAST_TICK - 250, 6)])
def test_half_a_second_of_silence_makes_the_car_begin_anew(start_ms, cut):
    car = ReceivingCar(OLD)
    car.take(NEW[:cut], start_ms)
    assert car.take(b"", start_ms + 250 & LAST_TICK) == ([], b"")
    assert car.take(b"", start_ms + 499 & LAST_TICK) == ([], b"")
    assert car.take(b"", start_ms + 500 & LAST_TICK) == ([upload.REFUSED], b"ERR cut off after %d bytes\n" % cut)
    assert car.take(b"", start_ms + 2_000 & LAST_TICK) == ([], b"")
    assert car.stored == OLD
    assert car.take(NEW, start_ms + 2_001 & LAST_TICK) == ([upload.IMAGE], NEW_OK)


def test_silence_is_noticed_when_the_next_byte_comes():
    car = ReceivingCar(OLD)
    car.take(NEW[:6], 0)
    assert car.take(NEW, 500) == ([upload.REFUSED, upload.IMAGE], b"ERR cut off after 6 bytes\n" + NEW_OK)


@pytest.mark.parametrize(
    ("bad", "reason"),
    [
        (BAD_HEADER, b"image-header word=0x0001"),
        (BAD_WORD, b"image-word position=1 word=0x40000001"),
        (bytes.fromhex("01000000 40000200"), b"image-word position=1 word=0x40000200"),
        # No dwell where words for followers are; a dwell, or tags, where none are; no leader that could decide.
        (bytes.fromhex("00010000"), b"image-header word=0x00010000"),
        (bytes.fromhex("01000100"), b"image-header word=0x01000100"),
        (bytes.fromhex("01000001"), b"image-header word=0x01000001"),
        (bytes.fromhex("01000101"), b"image-header word=0x01000101"),
        (bytes.fromhex("00010102"), b"image-header word=0x00010102"),
        (bytes.fromhex("00000002"), b"image-header word=0x00000002"),
        (bytes.fromhex("01010104"), b"image-header word=0x01010104"),
    ],
)
def test_after_bytes_that_are_no_image_only_silence_begins_the_next(bad, reason):
    car = ReceivingCar(OLD)
    kinds, answer = car.take(bad, 0)
    assert kinds == [upload.REFUSED]
    assert answer.startswith(b"ERR ")
    assert reason in answer
    assert answer.endswith(b"\n")
    # The rest of what was wrong is no image, even if it looks like one, and needs no second answer.
    assert car.take(NEW, 400) == ([], b"")
    assert car.take(NEW, 899) == ([], b"")
    assert car.stored == OLD
    assert car.take(NEW, 1_399) == ([upload.IMAGE], NEW_OK)


def test_four_zeros_are_an_image_only_between_silences():
    car = ReceivingCar(OLD)
    assert car.take(NO_PROGRAM, 0) == car.take(b"", 499) == ([], b"")
    assert car.take(b"", 500) == ([upload.IMAGE], upload.ok_line(NO_PROGRAM))
    assert car.stored == NO_PROGRAM


@pytest.mark.parametrize("noise", [bytes(5), bytes(400), b"\0" + upload.READBACK_REQUEST, NO_PROGRAM + NEW])
def test_zeros_that_a_loose_cable_leaves_do_not_clear_a_car(noise):
    car = ReceivingCar(OLD)
    kinds, answer = car.take(noise, 0)
    assert kinds == [upload.REFUSED]
    assert answer == f"ERR the empty image has 4 bytes, {len(noise)} are here\n".encode()
    assert car.take(b"", 10_000) == ([], b"")
    assert car.stored == OLD


# The uploader's end


@given(garbage=st.binary(max_size=300).filter(lambda data: b"OK " not in data and b"ERR " not in data))
@example(garbage=bytes(300))
def test_garbage_before_the_answer_does_no_harm(garbage):
    assert outcome_of(waiting_uploader(), garbage + NEW_OK, 10) == uploader.VERIFIED


@pytest.mark.parametrize("boot", [b"rst cause:2, flash OK \r\n", b"LED OK now\n"])
def test_the_messages_of_a_starting_board_are_no_answer(boot):
    end = waiting_uploader()
    assert outcome_of(end, boot, 10) is None
    end.receive_data(NEW_OK.replace(b"\n", b"\r\n"), 20)
    assert end.outcome == (uploader.VERIFIED, "OK words=3 crc32=325d103a")


def test_an_image_behind_its_check_fits_into_a_buffer_that_both_fill():
    """It moves to the beginning of the buffer once the check is taken."""
    image = bytes([9, 0, 0, 0]) + bytes.fromhex("64800000") * 9
    car = ReceivingCar(OLD, 12)
    kinds, answer = car.take(request.check_request(crc32(image), 1) + image, 0)
    assert (kinds, car.stored) == ([upload.CHECK, upload.IMAGE], image)
    assert answer.endswith(upload.ok_line(image))


def test_the_position_of_a_bad_word_counts_from_its_own_header():
    car = ReceivingCar(OLD)
    bad = bytes.fromhex("02000000 65800000 40000001")
    kinds, answer = car.take(request.check_request(crc32(bad), 1) + bad, 0)
    assert kinds == [upload.CHECK, upload.REFUSED]
    assert b"image-word position=2" in answer


@pytest.mark.parametrize("answer", [b"OK words=3 crc32=325d103b", b"OK words=2 crc32=325d103a", b"OK words=3"])
def test_an_answer_about_another_image_is_a_mismatch_that_shows_both(answer):
    end = waiting_uploader()
    assert outcome_of(end, answer + b"\n", 10) == uploader.MISMATCH
    assert f"'{answer.decode()}'" in str(end.outcome.detail)
    assert NEW_OK.decode().strip() in str(end.outcome.detail)


def test_a_refusal_stands_at_the_beginning_or_behind_noise():
    for line in (b"ERR busy", b"\xffERR busy", b"\x7fERR busy"):
        assert uploader.refusal(line) == "busy"
    assert uploader.refusal(b"ERR a ERR b") == "a ERR b"
    # Behind text it is a message of the board itself.
    assert [uploader.refusal(line) for line in (b"xERR busy", b" ERR busy", b"~ERR a")] == [None] * 3


def test_a_refusal_counts_while_the_image_is_being_sent():
    end = uploader.UploaderEnd(NEW)
    end.receive_data(b"\xff\0ERR cut off\x1b\x7f\xff\n", 5)
    end.finish_sending(10)
    assert end.outcome == (upload.REFUSED, "cut off???")  # noise does nothing to the user's terminal


@pytest.mark.parametrize("sent_ms", [0, LAST_TICK - 1_000])
def test_two_seconds_after_the_last_byte_a_silent_car_is_reported(sent_ms):
    end = uploader.UploaderEnd(NEW)
    assert outcome_of(end, b"", sent_ms - 10_000 & LAST_TICK) is None  # a slow line may take as long as it likes
    end.finish_sending(sent_ms)
    assert outcome_of(end, b"OK words=3", sent_ms + 1_999 & LAST_TICK) is None
    end.receive_data(b"", sent_ms + 2_000 & LAST_TICK)
    assert end.outcome == (uploader.SILENT, Phrase("no-answer-within", duration_ms=2000))


def test_a_large_image_has_more_time():
    """An EEPROM takes 3.4 ms a byte."""
    assert upload.answer_within_ms(bytes(2044)) == 10_220


@pytest.mark.parametrize(
    ("answer", "kind"),
    [
        (NEW_OK, uploader.VERIFIED),
        (upload.ok_line(OLD), uploader.MISMATCH),
        (upload.error_line("busy"), upload.REFUSED),
    ],
)
def test_an_upload_has_one_outcome(answer, kind):
    end = waiting_uploader()
    assert [outcome_of(end, data, now_ms) for data, now_ms in ((answer, 10), (NEW_OK, 20), (b"", 9_999))] == [kind] * 3


# The reader's end


@pytest.mark.parametrize(
    ("data", "detail"),
    [
        (b"", Phrase("no-answer-within", duration_ms=2000)),
        (NEW[:-1], Phrase("car-stopped-after", count=11)),
        (b"ERR bus", Phrase("car-stopped-after", count=7)),
    ],
)
def test_a_car_that_stops_is_reported_to_the_reader(data, detail):
    end = uploader.ReadbackEnd(LAST_TICK)
    assert outcome_of(end, data, LAST_TICK) is None
    assert outcome_of(end, b"", 1_998) is None
    end.receive_data(b"", 1_999)
    assert end.outcome == (uploader.SILENT, detail)


@pytest.mark.parametrize(
    ("data", "detail"),
    [(b"ERR busy\nready\n", "busy"), (BAD_HEADER, "dwell is 3"), (BAD_WORD, "parity is 1"), (b"ready\n", "no image")],
)
def test_what_comes_back_and_is_no_image_is_refused_with_the_reason(data, detail):
    end = uploader.ReadbackEnd(0)
    assert outcome_of(end, data, 10) == upload.REFUSED
    assert detail in str(end.outcome.detail)
    assert "?" not in str(end.outcome.detail)


def test_a_slow_readback_goes_on_for_as_long_as_bytes_come():
    end = uploader.ReadbackEnd(0)
    for number, byte in enumerate(NEW):
        end.receive_data(bytes([byte]), 1_999 * number)
        end.receive_data(b"", 1_999 * number + 1_998)
    assert end.outcome == (upload.IMAGE, NEW)


# Anything at all

SNIPPETS = st.sampled_from(
    [NEW, NEW[:6], CHECK_OF_NEW, upload.READBACK_REQUEST, NEW_OK, BAD_HEADER, BAD_WORD, b"ERR busy\n", b""]
)
ARRIVALS = st.lists(st.tuples(SNIPPETS | images() | st.binary(max_size=40), st.integers(0, 1_500)), max_size=12)


@given(arrivals=ARRIVALS, start_ms=STARTS_MS)
def test_a_car_survives_any_bytes(arrivals, start_ms):
    for event in events_of(upload.CarEnd(), arrivals, start_ms):
        if event.kind == upload.IMAGE:
            parse_image_bytes(event.image)
            assert event.answer == upload.ok_line(event.image)
        elif event.kind == upload.REFUSED:
            assert event.answer.startswith(b"ERR ")
            assert event.answer[:-1].decode("ascii").isprintable()
            assert event.answer.endswith(b"\n")
        elif event.kind == upload.CHECK:
            assert event.answer.startswith(b"OK check=")
        else:
            assert event == (upload.READBACK, b"", b"")


def outcome_after(end, arrivals, now_ms):
    """The outcome after arrivals, each after its pause, which can be printed; None where there is none."""
    for data, pause_ms in arrivals:
        now_ms = now_ms + pause_ms & LAST_TICK
        end.receive_data(data, now_ms)
    assert end.outcome is None or end.outcome.kind == upload.IMAGE or str(end.outcome.detail).isprintable()
    return end.outcome or (None, None)


@given(arrivals=ARRIVALS, start_ms=STARTS_MS)
def test_an_uploader_survives_any_bytes(arrivals, start_ms):
    kind, _ = outcome_after(waiting_uploader(start_ms), arrivals, start_ms)
    assert kind in {None, uploader.VERIFIED, uploader.MISMATCH, upload.REFUSED, uploader.SILENT}
    assert kind != uploader.VERIFIED or NEW_OK in b"".join(data for data, _ in arrivals)


@given(arrivals=ARRIVALS, start_ms=STARTS_MS)
def test_a_reader_survives_any_bytes(arrivals, start_ms):
    kind, detail = outcome_after(uploader.ReadbackEnd(start_ms), arrivals, start_ms)
    assert kind in {None, upload.IMAGE, upload.REFUSED, uploader.SILENT}
    if kind == upload.IMAGE:
        parse_image_bytes(detail)
