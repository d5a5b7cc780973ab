"""Talks with all kinds of cars, in virtual time: boards that know no checks, slow lines."""

from random import Random
from zlib import crc32

import pytest

from motorcade.errors import Phrase
from motorcade.upload.transfer import (
    ASKS_AGAIN,
    NEITHER,
    NEW,
    OLD,
    READS_AGAIN,
    SENDS_AGAIN,
    SETTLE_MS,
    UNKNOWN,
    ReadbackTransfer,
    UploadTransfer,
    upload_error,
)
from motorcade.words.image import parse_image_bytes
from motorcade.words.packing import ImageError
from motorcade.words.request import CHECK_BYTES, check_words, held_checksum, ready_line
from motorcade.words.upload import IMAGE, REFUSED, ok_line
from motorcade.words.uploader import MISMATCH, NOT_VERIFIED, SILENT, VERIFIED, Outcome
from support.faulty_line import Faults, RealCar, SimpleCar, Way, talk_through
from support.upload_ends import read_check

BAUD = 115200
FIRST = bytes.fromhex("01000000 64800000")
SECOND = bytes.fromhex("02000000 65800000 6A800000")
THIRD = bytes.fromhex("01000000 6D000000")
LARGEST = bytes.fromhex("FFFF0100" + "64800000" * 255 + "C0280000" * 255)
CLEAN = Faults()


def ways(there=CLEAN, back=CLEAN, seed=0):
    random = Random(seed)
    return Way(there, random), Way(back, random)


class Told(list):
    """What a talk tells of its further tries: their reasons."""

    def __call__(self, retry):
        self.append(retry.key)


# Cars that know no checks


def knows_the_rules(image):
    """Why a car that keeps to the rules refuses ``image``."""
    try:
        parse_image_bytes(image)
    except ImageError as error:
        return str(error)
    return None


def is_curt(image):
    return "no" if knows_the_rules(image) else None


def takes_all(image):
    return None


@pytest.mark.parametrize("judge", [knows_the_rules, is_curt, takes_all])
@pytest.mark.parametrize("image", [SECOND, LARGEST], ids=["three words", "511 words"])
def test_a_car_that_knows_no_checks_is_sent_the_image_as_it_is(judge, image):
    there, back = ways()
    talk, car = UploadTransfer(image, BAUD), SimpleCar(FIRST, there, back, judge)
    talk_through(talk, car, there, back)
    assert talk.outcome == (VERIFIED, ok_line(image).decode().strip())
    assert talk.holds == NEW
    assert car.holds == image


# The bytes of each try that such a car takes the words of: the request, and then the image three times.
IN_THE_TRIES = tuple(CHECK_BYTES + len(SECOND) * number + 6 for number in range(3))


def test_to_a_car_that_knows_no_checks_changed_bytes_are_sent_again_until_it_holds_the_image():
    told = Told()
    there, back = ways(Faults(flipped_at=IN_THE_TRIES[:2]))
    talk, car = UploadTransfer(SECOND, BAUD, retrying=told), SimpleCar(FIRST, there, back, takes_all)
    talk_through(talk, car, there, back)
    assert (talk.holds, car.holds, told) == (NEW, SECOND, [SENDS_AGAIN, SENDS_AGAIN])


@pytest.mark.parametrize(
    ("there", "back", "holds", "kind"),
    [
        (Faults(flipped_at=IN_THE_TRIES), CLEAN, NEITHER, MISMATCH),
        # All but the answer to the request gets lost.
        (CLEAN, Faults(dead_from=len(ok_line(bytes(CHECK_BYTES)))), UNKNOWN, SILENT),
    ],
)
def test_what_a_car_that_knows_no_checks_may_hold_is_told(there, back, holds, kind):
    there, back = ways(there, back)
    talk, car = UploadTransfer(SECOND, BAUD), SimpleCar(FIRST, there, back, takes_all)
    talk_through(talk, car, there, back)
    assert (talk.outcome.kind, talk.holds) == (kind, holds)
    assert (car.holds == SECOND) == (kind == SILENT)


def test_a_refusal_of_a_car_that_knows_no_checks_is_final():
    there, back = ways()
    told = Told()
    talk = UploadTransfer(SECOND, BAUD, retrying=told)
    car = SimpleCar(FIRST, there, back, lambda image: "battery low")
    talk_through(talk, car, there, back)
    assert talk.outcome == (REFUSED, "battery low")
    assert (talk.holds, car.holds) == (OLD, FIRST)
    assert told == [ASKS_AGAIN, ASKS_AGAIN]


def test_without_verifying_nothing_but_the_image_is_sent():
    talk = UploadTransfer(SECOND, BAUD, verify=False)
    sent = b"".join(talk.step(b"", now_ms) for now_ms in range(0, 5000, 10))
    assert sent == SECOND
    assert talk.outcome == (NOT_VERIFIED, Phrase("sent-not-verified"))
    assert talk.holds == UNKNOWN


# Cars that know checks


@pytest.mark.parametrize("bit", range(8))
def test_a_line_with_a_stuck_bit_makes_no_car_look_as_if_it_knew_no_checks(bit):
    there, back = ways(Faults(stuck=1 << bit))
    talk, car = UploadTransfer(SECOND, BAUD), RealCar(FIRST, there, back)
    talk_through(talk, car, there, back)
    assert (talk.outcome.kind, talk.holds, car.holds) == (REFUSED, OLD, FIRST)


def test_an_image_that_the_car_can_not_hold_is_sent_once_and_the_car_keeps_its_own():
    there, back = ways()
    told = Told()
    talk, car = UploadTransfer(LARGEST, BAUD, retrying=told), RealCar(FIRST, there, back, most_words=126)
    talk_through(talk, car, there, back)
    assert (talk.outcome, talk.holds, car.holds) == ((REFUSED, "image-too-large most=126 words=511"), OLD, FIRST)
    assert told == []
    assert "this car holds at most 126" in str(upload_error("port", talk.outcome, talk.holds))


def test_a_refusal_that_nobody_knows_is_told_as_the_car_said_it():
    assert "refused: it is too warm" in str(upload_error("port", Outcome(REFUSED, "it is too warm"), OLD))


@pytest.mark.parametrize("seed", range(8))
def test_an_image_that_is_larger_on_its_way_alone_is_sent_again(seed):
    # Some bit of its header changes, and with some of them the car counts more words than it can hold.
    there, back = ways(Faults(flipped_at=(CHECK_BYTES + 1,)), seed=seed)
    talk, car = UploadTransfer(SECOND, BAUD), RealCar(FIRST, there, back, most_words=CHECK_BYTES // 4)
    talk_through(talk, car, there, back)
    assert (talk.outcome.kind, talk.holds, car.holds) == (VERIFIED, NEW, SECOND)


def test_a_car_that_holds_something_else_afterwards_is_told_of():
    # It takes any image for THIRD.
    talk, sent, now_ms = UploadTransfer(SECOND, BAUD), b"", 0
    answer, held = b"", FIRST
    while talk.outcome is None:
        sent += talk.step(answer, now_ms)
        answer = b""
        if len(sent) == CHECK_BYTES:
            answer, sent = ready_line(check_words(*read_check(sent)), held), b""
        elif sent == SECOND:
            answer, sent, held = ok_line(THIRD), b"", THIRD
        now_ms += 10
    assert (talk.outcome.kind, talk.holds) == (MISMATCH, NEITHER)


def test_an_answer_to_an_earlier_request_is_no_answer():
    talk, requests, now_ms = UploadTransfer(SECOND, BAUD, number=255), [], 0
    while talk.outcome is None:
        if sent := talk.step(b"", now_ms):
            requests.append(sent)
        now_ms += 10
    numbers = [read_check(request)[1] for request in requests]
    assert numbers == [255, 0, 1]
    late = ready_line(check_words(crc32(SECOND), 255), FIRST)
    assert held_checksum(late, check_words(crc32(SECOND), 0)) is None
    assert (talk.outcome.kind, talk.holds) == (SILENT, OLD)


# Readback


def test_an_image_that_comes_back_damaged_is_read_again():
    there, back = ways(back=Faults(dead_until=5, dead_from=3))
    told = Told()
    talk = ReadbackTransfer(BAUD, told)
    talk_through(talk, RealCar(SECOND, there, back), there, back)
    assert talk.outcome == (IMAGE, SECOND)
    assert told == [READS_AGAIN]


# The line's pace


@pytest.mark.parametrize("baud", [1200, 9600, 115200])
def test_bytes_are_sent_as_fast_as_the_line_carries_them_and_progress_is_the_lines(baud):
    progress, now_ms, sent = [], 0, b""
    talk = UploadTransfer(LARGEST, baud, verify=False, sent=progress.append)
    begun_ms = None
    while talk.outcome is None:
        piece = talk.step(b"", now_ms)
        if piece and begun_ms is None:
            begun_ms = now_ms
        sent += piece
        if begun_ms is not None:
            assert len(sent) <= 64 + (now_ms - begun_ms) * baud // 10_000
        now_ms += 10
    assert sent == LARGEST
    assert progress == sorted(set(progress))
    assert progress[-1] == len(LARGEST)
    assert begun_ms >= SETTLE_MS
    needed_ms = len(LARGEST) * 10_000 / baud
    assert needed_ms <= now_ms - begun_ms <= needed_ms + 50


def test_the_answer_is_awaited_from_when_the_last_byte_has_left_a_slow_line():
    # 2,044 bytes take 17 s.
    there, back = ways()
    talk, car = UploadTransfer(LARGEST, 1200), RealCar(FIRST, there, back)
    talk_through(talk, car, there, back)
    assert (talk.holds, car.holds) == (NEW, LARGEST)


class ChattyCar(RealCar):
    """A car whose board has something to say every 100 ms."""

    def __init__(self, stored, there, back):
        super().__init__(stored, there, back)
        self._back, self._said_ms = back, 0

    def tick(self, now_ms):
        if now_ms >= self._said_ms:
            self._said_ms = now_ms + 100
            self._back.put(b"battery 97 %\n", self._said_ms)
        super().tick(now_ms)


def test_a_board_that_never_stops_talking_is_talked_to_nevertheless():
    there, back = ways()
    talk, car = UploadTransfer(SECOND, BAUD), ChattyCar(FIRST, there, back)
    talk_through(talk, car, there, back)
    assert (talk.holds, car.holds) == (NEW, SECOND)
