"""Requests to cars, on lines that lose, double and change bytes; a car accepts the announced image alone."""

from binascii import crc32

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from motorcade.words import request, upload
from motorcade.words.formats import HEADER
from support.upload_ends import (
    CHECK_OF_NEW,
    LAST_TICK,
    NEW,
    NEW_OK,
    OLD,
    STARTS_MS,
    ReceivingCar,
    events_of,
    images,
    pieces,
    programs,
)

REQUESTS = st.builds(
    request.car_request, st.sampled_from("abnsg"), st.integers(0, 255), st.sampled_from(["", "ada", "阿达", "x" * 32])
)


@given(kind=st.sampled_from("abnsg"), number=st.integers(0, 255), name=st.sampled_from(["", "ada", "阿达" * 5]))
def test_a_car_reads_what_was_asked(kind, number, name):
    data = request.car_request(kind, number, name)
    assert (len(data), min(data) >= 32) == (request.REQUEST_BYTES, True)
    assert request.read_request(data) == (kind, f"{number:02x}", name)
    line = request.answer_line(request.read_request(data), (("name", name), ("battery", "")))
    fields = {"car": f"{kind}{number:02x}"} | ({"name": name} if name else {})
    assert request.read_answer(line) == request.read_answer(b"\xff noise " + line) == fields


@given(parts=st.lists(images() | REQUESTS, max_size=4), data=st.data())
def test_a_stream_is_split_into_uploads_and_requests_wherever_it_is_cut(parts, data):
    whole, uploads, requests, rest = b"".join(parts), b"", [], b""
    for piece in data.draw(pieces(whole)) if len(whole) > 1 else [whole]:
        taken, found, rest = request.split_requests(rest + piece)
        uploads, requests = uploads + taken, requests + found
    assert requests == [each for each in parts if each.startswith(request.REQUEST_BEGINS)]
    assert uploads + rest == b"".join(each for each in parts if not each.startswith(request.REQUEST_BEGINS))


def test_no_more_bytes_wait_than_a_request_may_begin_with():
    assert request.split_requests(b"\xf0" * 5) == (b"\xf0" * 2, [], b"\xf0" * 3)
    assert request.split_requests(b"\xf0") == (b"", [], b"\xf0")
    assert request.split_requests(b"\0\xf0") == (b"\0", [], b"\xf0")


@given(text=st.binary(min_size=36, max_size=36))
@example(text=b"a\xe9\xe9 ".ljust(36))
def test_what_a_stranger_asks_is_read_or_is_no_request(text):
    """A car that failed here would start again and again."""
    digits = bytes(64 + (crc32(text) >> shift & 15) for shift in range(28, -4, -4))
    asked = request.read_request(request.REQUEST_BEGINS + text + digits)
    assert asked is None or request.answer_line(asked, ()).startswith(b"OK car=")


@pytest.mark.parametrize("name", ["\u3000ada", "XanaX"])
def test_only_the_spaces_behind_a_name_are_no_part_of_it(name):
    assert request.read_request(request.car_request("n", 0, name)).name == name


def test_a_request_without_a_name_has_none_and_begins_with_its_header():
    asked = request.car_request("a", 1)
    assert request.read_request(asked).name == ""
    assert request.read_request(b"\0" + asked[1:]) is None


def test_a_stranger_s_answer_is_split_at_spaces_and_at_the_first_equals_sign_alone():
    asked = request.Request("a", "01", "")
    line = request.answer_line(asked, (("name", "a=b\u3000c"),))
    assert request.read_answer(line) == {"car": "a01", "name": "a=b\u3000c"}
    assert request.read_answer(b"x sum=1 " + line) == {"car": "a01", "name": "a=b\u3000c"}


def test_an_answer_that_another_one_cut_off_is_none():
    line = request.answer_line(request.Request("a", "01", ""), ())
    assert request.read_answer(line[:9] + line) is None
    beginning = request.check_words(5, 1)
    ready = request.ready_line(beginning, NEW)
    assert request.held_checksum(ready, beginning) == crc32(NEW)
    assert request.held_checksum(beginning + ready, beginning) is None


@given(asked=REQUESTS, before=st.sampled_from([b"", NEW, request.check_request(crc32(NEW), 1)]), start_ms=STARTS_MS)
def test_a_request_is_answered_wherever_it_stands_and_changes_no_upload(asked, before, start_ms):
    end = upload.CarEnd()
    events = events_of(end, [(before, 600), (asked, 0), (asked, 0)], start_ms)
    assert [event.image for event in events if event.kind == upload.REQUEST] == [asked, asked]
    # What was announced before still counts.
    assert [event.answer for event in events_of(end, [(NEW, 0)], start_ms + 600 & LAST_TICK)] == [NEW_OK]


@given(data=st.data(), asked=REQUESTS)
def test_a_request_that_was_changed_on_the_way_is_no_request_and_no_image(data, asked):
    kind = data.draw(st.sampled_from(["lost", "doubled", "flipped"]))
    at, count = data.draw(st.integers(0, 47)), data.draw(st.integers(1, 20))
    if kind == "lost":
        came = asked[:at] + asked[at + count :]
    elif kind == "doubled":
        came = asked[:at] + asked[at : at + count] + asked[at:]
    else:
        came = asked[:at] + bytes([asked[at] ^ 1 << data.draw(st.integers(0, 7))]) + asked[at + 1 :]
    car = ReceivingCar(OLD)
    kinds, _ = car.take(came, 0)
    late, _ = car.take(b"", 600)
    assert upload.IMAGE not in kinds + late
    assert car.stored == OLD
    if upload.REQUEST in kinds:
        # The upper bits of a digit of the checksum mean nothing, and what stands behind the whole request isn't it.
        assert request.read_request(came[:48]) == request.read_request(asked)


@given(image=images(), number=st.integers(0, 255))
def test_no_upload_holds_the_header_of_a_request(image, number):
    """So a line may take requests out of an upload wherever they are."""
    stream = request.check_request(crc32(image), number) + image
    assert request.REQUEST_BEGINS not in stream + stream
    assert not stream.endswith(request.REQUEST_BEGINS[:1])


def test_an_older_car_keeps_its_program():
    """It waits for the words that the header announces; 500 ms later it refuses what came."""
    header = request.REQUEST_HEADER
    assert 1 + (header >> 24) + (header >> 16 & 255) > request.REQUEST_BYTES // 4
    assert header & 255 > HEADER.field("reserved").defined


def test_names_are_letters_of_any_language():
    good = {"ada", "x", "x" * 32, "阿达-2_x", "\x80"}
    assert {
        name for name in (*good, "x" * 33, "", "a b", "a=b", "é" * 17, "a\n", "\x7f") if request.is_car_name(name)
    } == good


@pytest.mark.parametrize(
    "line", [b"", b"OK car=a00 sum=12345678", b"\xff\xfe sum=", b"OK words=3 crc32=0", b"x sum=%08x\n" % crc32(b"x")]
)
def test_what_is_no_answer_is_none(line):
    assert request.read_answer(line) is None


@given(image=images(), held=images(), number=st.integers(0, 255), start_ms=STARTS_MS, data=st.data())
def test_a_car_accepts_the_announced_image(image, held, number, start_ms, data):
    car, checksum = ReceivingCar(held), crc32(image)
    taken = [car.take(piece, start_ms) for piece in data.draw(pieces(request.check_request(checksum, number)))]
    answer = b"".join(said for _, said in taken)
    assert request.held_checksum(answer, request.check_words(checksum, number)) == crc32(held)
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
    beginning = b"OK check=325d103a07 holds=%08x" % crc32(OLD)
    assert ReceivingCar(OLD).take(CHECK_OF_NEW, 0) == ([upload.CHECK], beginning + b" sum=%08x\n" % crc32(beginning))


@given(image=programs.filter(lambda image: image != NEW))
def test_a_car_refuses_another_image_than_the_announced_one(image):
    car = ReceivingCar(OLD)
    car.take(CHECK_OF_NEW, 0)
    assert car.take(image, 1)[0] == [upload.REFUSED]
    assert car.take(NEW, 400) == ([], b"")  # the rest of what was wrong
    assert car.take(image, 1_000)[0] == [upload.REFUSED]  # the checksum holds until the right image comes
    assert car.take(NEW, 2_000) == ([upload.IMAGE], NEW_OK)
    assert car.stored == NEW


def test_ten_seconds_after_an_announcement_a_car_accepts_any_image():
    car = ReceivingCar(NEW)
    car.take(CHECK_OF_NEW, 0)
    assert car.take(OLD, 9_999)[0] == [upload.REFUSED]
    assert car.take(OLD, 19_999)[0] == [upload.IMAGE]


def test_what_comes_right_behind_an_image_that_was_announced_is_no_image():
    car = ReceivingCar(OLD)
    assert car.take(CHECK_OF_NEW + NEW + OLD, 0)[0] == [upload.CHECK, upload.IMAGE]
    assert car.take(OLD, 499) == ([], b"")
    assert car.stored == NEW
    assert car.take(OLD, 999)[0] == [upload.IMAGE]


FAULTS = {"lost": lambda byte: [], "doubled": lambda byte: [byte, byte]} | {
    f"bit {bit}": lambda byte, bit=bit: [byte ^ 1 << bit] for bit in range(8)
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_check_request_with_a_fault_is_no_image_and_gets_no_answer_that_is_mistaken(fault):
    for at, byte in enumerate(CHECK_OF_NEW):
        car = ReceivingCar(OLD)
        kinds, answer = car.take(CHECK_OF_NEW[:at] + bytes(FAULTS[fault](byte)) + CHECK_OF_NEW[at + 1 :], 0)
        more, _ = car.take(b"", 500)
        assert upload.IMAGE not in kinds + more, at
        assert car.stored == OLD, at
        understood = request.held_checksum(answer, request.check_words(0x325D103A, 7)) is not None
        assert understood == (fault == "doubled" and at == request.CHECK_BYTES - 1), at


@given(at=st.integers(0, 60), bit=st.integers(0, 7))
def test_an_answer_with_a_flipped_bit_is_ignored(at, bit):
    line = bytearray(request.ready_line(request.check_words(1, 2), OLD))
    line[at % (len(line) - 1)] ^= 1 << bit
    assert request.held_checksum(bytes(line), request.check_words(1, 2)) is None
