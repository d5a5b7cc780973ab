"""Requests to cars, on lines that lose, double and change bytes."""

from binascii import crc32

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.words import receiver, request, upload
from motorcade.words.check import check_request
from support.upload_ends import LAST_TICK, NEW, NEW_OK, OLD, STARTS_MS, Car, events_of, images

REQUESTS = st.builds(
    request.car_request, st.sampled_from("abnsg"), st.integers(0, 255), st.sampled_from(["", "ada", "阿达", "x" * 32])
)


@given(kind=st.sampled_from("abnsg"), number=st.integers(0, 255), name=st.sampled_from(["", "ada", "阿达" * 5]))
def test_a_car_reads_what_was_asked(kind, number, name):
    data = request.car_request(kind, number, name)
    assert (len(data), min(data) >= 32) == (request.REQUEST_BYTES, True)
    assert request.read_request(data) == (kind, f"{number:02x}", name)
    line = request.answer_line(request.read_request(data), (("name", name), ("battery", "")))
    assert request.read_answer(b"\xff noise " + line) == {"car": f"{kind}{number:02x}"} | (
        {"name": name} if name else {}
    )


@given(asked=REQUESTS, before=st.sampled_from([b"", NEW, check_request(crc32(NEW), 1)]), start_ms=STARTS_MS)
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
    car = Car(OLD)
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
    stream = check_request(crc32(image), number) + image
    assert request.REQUEST_BEGINS not in stream + stream
    assert not stream.endswith(request.REQUEST_BEGINS[:1])


def test_an_older_car_keeps_its_program():
    """It waits for the words that the header announces; 500 ms later it refuses what came."""
    header = request.REQUEST_HEADER
    assert 1 + (header >> 24) + (header >> 16 & 255) > request.REQUEST_BYTES // 4
    assert header & 255 > receiver._MOST_RESERVED


@pytest.mark.parametrize(
    ("name", "may"), [("ada", 1), ("阿达-2_x", 1), ("", 0), ("a b", 0), ("a=b", 0), ("é" * 17, 0), ("a\n", 0)]
)
def test_names_are_letters_of_any_language(name, may):
    assert request.is_car_name(name) == bool(may)


@pytest.mark.parametrize("line", [b"", b"OK car=", b"OK car=a00 sum=12345678", b"\xff\xfe sum=", b"OK words=3 crc32=0"])
def test_what_is_no_answer_is_none(line):
    assert request.read_answer(line) is None
