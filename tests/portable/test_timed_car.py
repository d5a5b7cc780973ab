"""How long a car's ticks are on a simulated chip that counts instructions, and what it loses meanwhile: nothing."""

import ast
import json
from binascii import crc32

import pytest
from test_microcontroller import CLASSROOM, HEARD, PLATFORMS, on_micropython, templates

from motorcade.config.pins import parse_pins
from motorcade.firmware.car_files import settings_of
from motorcade.words.flow import CALL, CHANCE, JUMP, TELL
from motorcade.words.formats import FLOW
from motorcade.words.infrared import frame_durations_us, to_frame
from motorcade.words.packing import words_to_bytes
from motorcade.words.request import ASK, car_request, check_request
from motorcade.words.upload import READBACK_REQUEST, ok_line
from support.chip_benches import SMALL

# No word of it passes on: a leader then looks at all of them.
LARGEST = bytes.fromhex("FFFF0100" + "64800000" * 255 + "80280000" * 255)
# Collections of garbage are among the turns.
LONGEST_TURN_US = 20_000
# With sixteen flow words in it that draw no number; frames begin in the tick after it.
LONGEST_WITH_CALLS_US = 8_000
# Its wheels stand.
LIGHTS = to_frame(0x80480000)
DRIVES = bytes.fromhex("01000000 26800000")
# A function that calls itself.
CALLS = FLOW.encode(op=CALL, target=0)
TELLS = FLOW.encode(op=TELL, target=0)
SECONDS = 4
FRAME_EVERY_US = 80_000
FRAMES = 40
UPLOAD = [
    [1000, "upload", list(check_request(crc32(LARGEST), 7))],
    [1300, "upload", list(LARGEST)],
    [2800, "upload", list(READBACK_REQUEST)],
]
INFRARED = [[100, "hear many", [frame_durations_us(HEARD), FRAME_EVERY_US, FRAMES]]]
# Frame behind frame, 5 ms between them as in the protocol.
WITHOUT_PAUSE_US = sum(frame_durations_us(HEARD)) + 5000
UART = "[serial]\ntransmit = 8\nreceive = 9\n"
CARS = [(chip, role, "") for chip in ("rp2040", "esp32") for role in ("leader", "follower")]
CARS.append(("rp2040", "follower", UART))


def played(
    chip: str, role: str, wired_further: str, script: list, seconds: int, *more: bool, **settings: object
) -> tuple[dict[str, int], list[tuple[str, str]]]:
    """Return the figures and the outputs of a car."""
    text = (templates() / f"{chip}.toml").read_text(encoding="utf-8") + wired_further
    wanted = settings_of(parse_pins(text, chip), CLASSROOM, role == "leader", number=77) | settings
    given = [json.dumps(each) for each in (wanted, PLATFORMS[chip], seconds, script, *more)]
    figures, outputs = {}, []
    for line in on_micropython("timed_car", given):
        first, _, rest = line.partition(" ")
        if first.isdigit():
            outputs.append(tuple(rest.split(" ", 1)))
        elif rest.isdigit():
            figures[first] = int(rest)
    return figures, outputs


@pytest.mark.parametrize(
    ("chip", "role", "wired_further"),
    [each if each[2] else pytest.param(*each, marks=pytest.mark.soak) for each in CARS],
)
def test_a_full_image_arrives_whole_and_no_tick_is_long(chip, role, wired_further, micropython_installed):
    script = UPLOAD + (INFRARED if role == "follower" else [])
    figures, outputs = played(chip, role, wired_further, script, SECONDS)
    answers = b"".join([ast.literal_eval(value) for what, value in outputs if what == "line"])
    assert answers.startswith(b"OK check=")
    assert answers.endswith(ok_line(LARGEST) + LARGEST)
    assert figures["longest_us"] <= LONGEST_TURN_US
    assert figures["collections"] > 0
    if role == "follower":
        # The air is never free: 0.5 s after the image came the car stores it anyway, and loses what comes meanwhile.
        assert FRAMES - 2 <= figures["heard"] < FRAMES
    else:
        assert any(what == "wheels" for what, _ in outputs)


@pytest.mark.parametrize(
    ("flash_is_slow", "longest_ms"),
    [(False, 80), pytest.param(True, 470, marks=pytest.mark.soak)],
    ids=["typical", "slowest"],
)
@pytest.mark.parametrize("role", ["leader", pytest.param("follower", marks=pytest.mark.soak)])
def test_a_car_that_drives_stands_while_it_stores_an_image(role, flash_is_slow, longest_ms, micropython_installed):
    drives = [[20, "upload", list(DRIVES)]] if role == "leader" else INFRARED
    figures, outputs = played("rp2040", role, "", drives + UPLOAD, SECONDS, False, flash_is_slow)
    assert any(what == "wheels" for what, _ in outputs)
    assert figures["turned_while_storing"] == 0
    assert longest_ms * 0.8 < figures["storing_us"] / 1000 < longest_ms
    answers = b"".join([ast.literal_eval(value) for what, value in outputs if what == "line"])
    assert answers.endswith(ok_line(LARGEST) + LARGEST)


@pytest.mark.parametrize(("chip", "before"), [("rp2040", 29), pytest.param("esp32", 24, marks=pytest.mark.soak)])
def test_a_follower_waits_with_an_image_until_the_air_is_free_and_loses_no_frame(chip, before, micropython_installed):
    """The last of the first frames ends while the image waits."""
    after = 7
    frames = [
        [100, "hear many", [frame_durations_us(LIGHTS), FRAME_EVERY_US, before]],
        [3300, "hear many", [frame_durations_us(LIGHTS), FRAME_EVERY_US, after]],
    ]
    figures, outputs = played(chip, "follower", "", frames + UPLOAD[:2], SECONDS, False, True)
    assert b"".join([ast.literal_eval(value) for what, value in outputs if what == "line"]).endswith(ok_line(LARGEST))
    assert figures["storing_us"] > 400_000
    assert figures["heard"] == before + after


@pytest.mark.parametrize(
    ("flow", "longest_us"),
    [
        (
            [FLOW.encode(op=JUMP, target=word + 1, condition=CHANCE, value=128) for word in range(16)],
            LONGEST_TURN_US,
        ),
        ([CALLS, CALLS], LONGEST_WITH_CALLS_US),
        ([TELLS, FLOW.encode(op=JUMP, target=0)], LONGEST_WITH_CALLS_US),
    ],
    ids=["chance", "calls", "tells"],
)
def test_a_tick_with_sixteen_flow_words_is_not_long(flow, longest_us, micropython_installed):
    image = words_to_bytes((len(flow) + 1 << 24 | 0x010103, *flow, 0x40280000, 0x80280000))
    figures, outputs = played("rp2040", "leader", "", [[500, "upload", list(image)]], 2)
    assert b"".join([ast.literal_eval(value) for what, value in outputs if what == "line"]) == ok_line(image)
    assert figures["longest_us"] <= LONGEST_TURN_US
    assert 4_000 < figures["longest_at_work_us"] <= longest_us


def test_an_upload_over_the_air_arrives_whole_and_no_tick_is_long(micropython_installed):
    """All its bytes are there at once, other than by a cable, and beside them come requests."""
    asks = [[at_ms, "air", list(car_request(ASK, at_ms >> 4 & 255))] for at_ms in (900, 1301, 1400)]
    script = asks + [[at_ms, "air", data] for at_ms, _, data in UPLOAD] + INFRARED
    figures, outputs = played("esp32", "follower", "", script, SECONDS, wifi={"ssid": "room", "password": "secret"})
    answers = b"".join([ast.literal_eval(value) for what, value in outputs if what == "line"])
    assert ok_line(LARGEST) + LARGEST in answers
    assert answers.count(b"OK car=a") == 3
    assert figures["longest_us"] <= LONGEST_TURN_US
    assert figures["announced"] == SECONDS - 1


def test_collections_cost_no_frame_where_interrupts_are_soft(micropython_installed):
    frames = 7_900_000 // WITHOUT_PAUSE_US
    script = [[50, "hear many", [frame_durations_us(HEARD), WITHOUT_PAUSE_US, frames]]]
    figures, _ = played("esp32", "follower", "", script, 8)
    assert figures["collections"] >= 2
    assert figures["heard"] == frames
    assert figures["longest_us"] <= LONGEST_TURN_US


def test_most_ticks_allocate_nothing(micropython_installed, monkeypatch):
    monkeypatch.setenv("MOTORCADE_HEAP_BYTES", "1000000")
    figures, _ = played("rp2040", "leader", "", [[100, "upload", list(SMALL)]], 1, True)
    assert figures["bytes_a_turn"] < 100
