"""The dissector in tshark shows what Python decodes."""

import asyncio
import random
import struct
import subprocess
from binascii import crc32
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

import pytest
from scripts.exports.wireshark import wireshark

from motorcade.drive.client import DriveClient
from motorcade.words.field import WordError
from motorcade.words.formats import CONTROL, DRIVE, FLOW, FRAME, HEADER, LIGHTS, STATE, switched_by
from motorcade.words.image import Image, image_words, parse_image_bytes
from motorcade.words.packing import ImageError, bytes_to_words, words_to_bytes
from motorcade.words.request import car_request, check_request
from motorcade.words.upload import READBACK_REQUEST, ok_line
from support.command_line import run
from support.driven_car import DrivenCar
from support.fault_proxy import FaultProxy
from support.rooms import simulated_cars
from support.waiting import DEADLINE_S

PORT = 5005
GOOD = [0x128CB000, 0x12ACB000, 0x1284B000, 0x19614000, 0x10000000, 0x1B4FF800]
COMMAND_FIELDS = {
    word_format: [
        f"motorcade_{word_format.name}.{name}" for name in ("word", *(field.name for field in word_format.fields))
    ]
    for word_format in (DRIVE, LIGHTS)
}
LIGHT_CODE = 2
BAD = [0x1B500000, 0x20000000, 0x00000000, 0xFFFFFFFF, 0x10000001, 0x30000000]
IMAGE = bytes.fromhex("01020200 64800000 80280000 c0280000")
SEPARATOR = "|"
# Of the classic pcap format; TCP segments are in IPv4.
RAW_IP, USER0 = 101, 147
_HOST, _CAR = bytes([10, 0, 0, 1]), bytes([10, 0, 0, 2])


def write_pcap(path: Path, link_type: int, packets: Iterable[bytes]) -> None:
    """Writes ``packets``, a millisecond apart."""
    data = struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 1 << 16, link_type)
    for number, packet in enumerate(packets):
        data += struct.pack("<IIII", 1_500_000_000, number * 1000, len(packet), len(packet)) + packet
    path.write_bytes(data)


def segments(pieces: Iterable[bytes], port: int, client_port: int = 40_000, answers: bool = False) -> list[bytes]:
    """One TCP segment for each of ``pieces``, from a client to ``port``, or from there where it ``answers``."""
    source, destination = (port, client_port) if answers else (client_port, port)
    ends = _CAR + _HOST if answers else _HOST + _CAR
    packets, sequence = [], 1
    for piece in pieces:
        # Data offset 5 words; flags PSH and ACK; a window; no checksum, which tshark leaves unchecked.
        tcp = struct.pack(">HHIIHHHH", source, destination, sequence, 1, 5 << 12 | 0x18, 1 << 14, 0, 0) + piece
        # Version 4, 5 words of header; don't fragment; 64 hops; TCP.
        ip = struct.pack(">BBHHHBBH", 0x45, 0, 20 + len(tcp), 0, 0x4000, 64, 6, 0) + ends
        packets.append(ip + tcp)
        sequence += len(piece)
    return packets


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dissectors")
    (folder / "motorcade_words.lua").write_text(wireshark(), encoding="utf-8")
    return folder


@pytest.fixture
def dissect(tshark, folder, tmp_path):
    """What tshark prints of chosen fields, a list of texts for each, packet by packet."""

    def run(link_type, packets, fields, *options):
        path = tmp_path / "capture.pcap"
        write_pcap(path, link_type, packets)
        script = f"lua_script:{folder / 'motorcade_words.lua'}"
        command = [str(tshark), "-X", script, "-r", str(path), *options, "-T", "fields"]
        command += ["-E", "occurrence=a", "-E", f"aggregator={SEPARATOR}", "-E", "separator=/t"]
        for field in fields:
            command += ["-e", field]
        ran = subprocess.run(command, capture_output=True, encoding="utf-8", check=False, timeout=DEADLINE_S)
        complaints = [line for line in ran.stderr.splitlines() if line and not line.startswith("Running as user")]
        assert (ran.returncode, complaints) == (0, [])
        rows = [line.split("\t") for line in ran.stdout.splitlines()]
        return [[text.split(SEPARATOR) if text else [] for text in row] for row in rows]

    return run


def sentences(word_format, word):
    """What Python says of a word: the reason to refuse it, and its warnings."""
    try:
        word_format.decode(word)
    except WordError as error:
        return [str(error), *map(str, word_format.warnings(word))]
    return [str(warning) for warning in word_format.warnings(word)]


def raw_values(word_format, word):
    return [word >> field.low & field.raw_mask for field in word_format.fields]


def filters(word_format, prefix):
    return [f"{prefix}.{field.name}" for field in word_format.fields]


def columns_of(rows, count):
    """The columns of all packets one behind the other."""
    return [[text for row in rows for text in row[column]] for column in range(count)]


def assert_shown(rows, word_format, words, marks):
    """All packets together show the words, their fields, and what Python says of them, which has one of the marks."""
    first, *fields, messages = columns_of(rows, len(rows[0]))
    assert [int(text, 16) for text in first] == words
    shown = [[int(text) for text in column] for column in fields]
    assert list(map(list, zip(*shown, strict=True))) == [raw_values(word_format, word) for word in words]
    said = [text for text in messages if any(mark in text for mark in marks)]
    assert said == [sentence for word in words for sentence in sentences(word_format, word)]


def pieces_of(data, dice):
    """``data`` cut anywhere: within words, between them, and several words in one piece."""
    cuts = sorted(dice.sample(range(1, len(data)), dice.randint(0, min(9, len(data) - 1))))
    return [data[start:end] for start, end in zip([0, *cuts], [*cuts, len(data)], strict=True)]


def test_drive_commands_cut_and_joined_anyhow_show_the_fields_that_python_decodes(dissect):
    dice = random.Random(5)
    packets, words = [], []
    for connection in range(150):
        sent = [dice.choice(GOOD + BAD) if dice.random() < 0.7 else dice.getrandbits(32) for _ in range(8)]
        words += sent
        packets += segments(pieces_of(words_to_bytes(tuple(sent)), dice), PORT, client_port=10_000 + connection)
    rows = dissect(RAW_IP, packets, [*COMMAND_FIELDS[DRIVE], *COMMAND_FIELDS[LIGHTS], "_ws.expert.message"])
    *columns, messages = columns_of(rows, len(rows[0]))
    for word_format, shown in ((DRIVE, columns[: len(DRIVE.fields) + 1]), (LIGHTS, columns[len(DRIVE.fields) + 1 :])):
        own = [word for word in words if (word >> 28 == LIGHT_CODE) == (word_format is LIGHTS)]
        assert [int(text, 16) for text in shown[0]] == own
        values = [[int(text) for text in column] for column in shown[1:]]
        assert list(map(list, zip(*values, strict=True))) == [raw_values(word_format, word) for word in own]
    said = [text for text in messages if "allowed" in text or "written" in text]
    assert said == [sentence for word in words for sentence in said_of_command(word)]


def said_of_command(word):
    """What Python says of a word that came as a drive command."""
    if word >> 28 == LIGHT_CODE:
        return sentences(LIGHTS, word)
    said = sentences(DRIVE, word)
    with suppress(WordError):
        switched_by(word)
        return said
    # A code that no command has: all codes are named.
    with pytest.raises(WordError) as caught:
        switched_by(word)
    return [str(caught.value), *said[1:]]


def test_neither_a_part_of_a_command_nor_what_the_car_answers_is_shown(dissect):
    data = words_to_bytes((GOOD[0], GOOD[1]))
    packets = segments([data[:4], data[4:7]], PORT) + segments([data[:4]], PORT, client_port=10_001, answers=True)
    assert dissect(RAW_IP, packets, ["motorcade_drive.word"]) == [[["0x128cb000"]], [[]], [[]]]


def test_another_port_and_the_other_byte_order_can_be_asked_for(dissect):
    data = b"".join(word.to_bytes(4, "little") for word in (GOOD[0], BAD[0], GOOD[1]))
    options = ["-o", "motorcade_drive.port:6000", "-o", "motorcade_drive.little:true"]
    fields = ["motorcade_drive.word", "motorcade_drive.angle", "motorcade_drive.speed", "_ws.expert.message"]
    (row,) = dissect(RAW_IP, segments([data], 6000), fields, *options)
    assert row[:3] == [["0x128cb000", "0x1b500000", "0x12acb000"], ["40", "181", "42"], ["150", "0", "150"]]
    assert row[3] == sentences(DRIVE, BAD[0])
    assert dissect(RAW_IP, segments([data], PORT), fields[:3], *options) == [[[], [], []]]


def test_refused_words_are_found_by_a_filter(dissect):
    packets = segments([words_to_bytes((word,)) for word in (GOOD[0], BAD[0], GOOD[1])], PORT)
    rows = dissect(RAW_IP, packets, ["motorcade_drive.angle"], "-Y", "motorcade_drive.refused")
    assert rows == [[["181"]]]


FRAME_FIELDS = ["motorcade_frame.word", *filters(FRAME, "motorcade_frame"), "_ws.expert.message"]
TAGGED = [0x00000000, 0xC0280045, 0x80280178, 0x80280177, 0x80280179, 0x80280002]


@pytest.mark.parametrize("over_tcp", [True, False], ids=["over TCP", "captured"])
def test_frames_show_tag_check_and_parity_and_what_is_wrong_with_them(dissect, over_tcp):
    dice = random.Random(3)
    words = TAGGED + [FRAME.complete(dice.getrandbits(32)) ^ 1 << bit for bit in range(32)]
    words += [FRAME.complete(dice.getrandbits(32)) for _ in range(50)] + [dice.getrandbits(32) for _ in range(50)]
    data = words_to_bytes(tuple(words))
    if over_tcp:
        options = ["-d", "tcp.port==6000,motorcade_frame"]
        rows = dissect(RAW_IP, segments(pieces_of(data, dice), 6000), FRAME_FIELDS, *options)
    else:
        rows = dissect(USER0 + 1, [data[:400], data[400:]], FRAME_FIELDS)
    assert_shown(rows, FRAME, words, ("drops this frame", "no effect"))


CONTROL_FIELDS = filters(CONTROL, "motorcade_image.control")
IMAGE_FIELDS = ["motorcade_image.header.word", "motorcade_image.control.word", *CONTROL_FIELDS, "_ws.expert.message"]


def image_row(data):
    """What is to be seen of an image's whole words, but for what is wrong with it."""
    words = bytes_to_words(data)
    columns = zip(*(raw_values(CONTROL, word) for word in words[1:]), strict=True)
    return [[f"0x{words[0]:08x}"], [f"0x{word:08x}" for word in words[1:]], *([str(r) for r in c] for c in columns)]


def test_captured_images_show_every_word(dissect):
    dice = random.Random(9)
    images = [IMAGE, bytes.fromhex("00010800 bffff000")]
    for _ in range(30):
        leader, followers = dice.randint(1, 6), dice.randint(0, 6)
        header = HEADER.encode(
            leader_states=leader, follower_words=followers, dwell=followers and 1 << dice.randint(0, 7)
        )
        words = [dice.getrandbits(32) & ~CONTROL.reserved_mask & ~1 for _ in range(leader + followers)]
        images.append(words_to_bytes((header, *words)))
        parse_image_bytes(images[-1])
    rows = dissect(USER0, images, IMAGE_FIELDS)
    assert [row[:-1] for row in rows] == [image_row(data) for data in images]
    assert [row[-1] for row in rows] == [[]] * len(images)


def test_the_words_of_a_leader_that_decides_are_shown_by_name(dissect):
    state = STATE.encode(forward=1, motor_enable=1, motor_duration=3, until=2, until_not=1)
    leader = (state, FLOW.encode(op=0, target=0, condition=5, level=2, counter=1, value=7), FLOW.encode(op=4, target=1))
    image = words_to_bytes(image_words(Image(leader, (0x80280000, 0x80480000), 0, 1, 1)))
    fields = [*filters(STATE, "motorcade_image.state"), *filters(FLOW, "motorcade_image.flow")]
    columns = zip(*(raw_values(FLOW, word) for word in leader[1:]), strict=True)
    expected = [[str(raw)] for raw in raw_values(STATE, state)] + [[str(raw) for raw in column] for column in columns]
    (row,) = dissect(USER0, [image], [*fields, "_ws.expert.message"])
    assert row == [*expected, []]
    (bad,) = dissect(USER0, [image[:8] + bytes.fromhex("d0000000") + image[12:]], ["_ws.expert.message"])
    assert "op is 5; allowed: 0 (jump), or 1 (call)" in " ".join(bad[0])


BAD_IMAGES = {
    IMAGE[:-4]: "cut off: its header announces 4 words, 3 are here",
    IMAGE + IMAGE[-4:]: "too long: its header announces 4 words, 5 are here",
    bytes.fromhex("00010300 c0000000"): "dwell is 3; allowed: 0, or one of 1, 2, 4, 8, 16, 32, 64, 128",
    bytes.fromhex("01000000 40000002"): "reserved is 1; allowed: 0 (reserved)",
    bytes.fromhex("01000000 40000001"): "parity is 1, an image writes 0",
}


def test_a_bad_image_has_the_same_message_as_in_python(dissect):
    rows = dissect(USER0, list(BAD_IMAGES), ["_ws.expert.message"])
    for (data, in_common), (messages,) in zip(BAD_IMAGES.items(), rows, strict=True):
        with pytest.raises(ImageError) as caught:
            parse_image_bytes(data)
        assert in_common in str(caught.value)
        assert in_common in " ".join(messages)


def test_uploads_over_tcp_and_their_answers_are_seen_where_one_asks_for_it(dissect):
    dice = random.Random(2)
    packets = []
    for connection in range(20):
        data = READBACK_REQUEST + IMAGE + IMAGE
        packets += segments(pieces_of(data, dice), 7000, client_port=10_000 + connection)
        packets += segments([ok_line(IMAGE)], 7000, client_port=10_000 + connection, answers=True)
    fields = ["motorcade_image.header.leader_states", "motorcade_image.control.word", "motorcade_image.answer"]
    rows = dissect(RAW_IP, packets, fields, "-d", "tcp.port==7000,motorcade_image")
    states, words, answers = columns_of(rows, 3)
    assert states == ["1"] * 40
    assert words == ["0x64800000", "0x80280000", "0xc0280000"] * 40
    assert len(answers) == 20
    assert answers[0].startswith(f"OK words=4 crc32={ok_line(IMAGE).split(b'=')[-1].decode().strip()}")


def test_what_cars_are_asked_is_shown_as_what_it_is(dissect):
    asked = [car_request(kind, 7 + at, name) for at, (kind, name) in enumerate([("a", ""), ("n", "小红"), ("s", "")])]
    flipped = bytes([*asked[1][:20], asked[1][20] ^ 1, *asked[1][21:]])
    sent = [*asked, check_request(0x89ABCDEF, 9), flipped, check_request(1, 2)[:-4] + bytes(4), IMAGE]
    answers = [b"OK car=a07 name=ada sum=12345678\n", b"ERR cut off after 3 bytes\n"]
    dice = random.Random(4)
    packets = segments(pieces_of(b"".join(sent), dice), 7000) + segments([b"".join(answers)], 7000, answers=True)
    names = ("request.kind", "request.number", "request.name", "check.checksum", "check.number", "answer")
    fields = [f"motorcade_image.{name}" for name in names]
    fields += ["motorcade_image.control.word", "_ws.expert.message"]
    rows = dissect(RAW_IP, packets, fields, "-d", "tcp.port==7000,motorcade_image")
    kinds, numbers, car_names, checksums, check_numbers, lines, words, messages = columns_of(rows, len(fields))
    assert kinds == ["who are you", "take a name", "stop", "take a name"]
    assert numbers == ["07", "08", "09", "08"]
    assert car_names[0] == "小红"
    assert checksums[0] == "0x89abcdef"
    assert check_numbers[0] == "9"
    assert [line.removesuffix("\\n") for line in lines] == [answer.decode().strip() for answer in answers]
    assert words == ["0x64800000", "0x80280000", "0xc0280000"]
    assert [text for text in messages if "changed on the way" in text] == [messages[0]] * 2


def recorded(proxy, port, client_port):
    """What passed through a proxy, as segments in their order."""
    packets, sent = [], {False: 0, True: 0}
    for is_answer, chunk in proxy.passed:
        (packet,) = segments([chunk], port, client_port, is_answer)
        packets.append(packet[:24] + struct.pack(">I", 1 + sent[is_answer]) + packet[28:])
        sent[is_answer] += len(chunk)
    return packets


def test_real_uploads_and_requests_are_shown(dissect, tmp_path):
    """The commands talk to a car, and tshark reads what they said."""
    image = tmp_path / "own.image"
    image.write_bytes(IMAGE)

    async def talk(car_port):
        packets = []
        commands = [
            ("upload", image, "--port", "{car}"),
            ("readback", "--port", "{car}", "-o", tmp_path / "back.image"),
            ("cars", "blink", "{address}"),
            ("cars", "stop", "--list", tmp_path / "cars.toml"),
        ]
        for number, command in enumerate(commands):
            async with FaultProxy(car_port) as proxy:
                (tmp_path / "cars.toml").write_text(f'ada = "127.0.0.1:{proxy.port}"\n', encoding="utf-8")
                address = f"127.0.0.1:{proxy.port}"
                typed = [str(word).format(car=f"socket://{address}", address=address) for word in command]
                ran = await asyncio.to_thread(run, *typed)
                assert ran.code == 0, ran.err
                packets += recorded(proxy, 7000, 10_000 + number)
        return packets

    with simulated_cars(1) as (car,):
        packets = asyncio.run(talk(int(car.address.rpartition(":")[2])))
    fields = [f"motorcade_image.{name}" for name in ("request.kind", "check.checksum", "answer", "control.word")]
    rows = dissect(RAW_IP, packets, [*fields, "motorcade_image.refused"], "-d", "tcp.port==7000,motorcade_image")
    kinds, checksums, answers, words, refused = columns_of(rows, 5)
    assert {"who are you", "blink", "stop"} <= {*kinds}
    assert checksums == [f"0x{crc32(IMAGE):08x}"]
    assert any(answer.startswith("OK words=4 crc32=") for answer in answers)
    # Sent, and sent back.
    assert words == ["0x64800000", "0x80280000", "0xc0280000"] * 2
    assert refused == []


def test_real_driving_with_lights_is_shown(dissect):
    async def drive(car):
        async with FaultProxy(car.port) as proxy, FaultProxy(car.telemetry_port) as telemetry:
            async with DriveClient("127.0.0.1", proxy.port, telemetry_port=telemetry.port) as driver:
                await driver.drive_for(0.2, 0.5, head_light=1)
            return recorded(proxy, PORT, 10_000)

    with DrivenCar() as car:
        packets = asyncio.run(drive(car))
    fields = ["motorcade_drive.speed", "motorcade_lights.head_light", "motorcade_drive.refused"]
    rows = dissect(RAW_IP, packets, fields)
    speeds, lights, refused = columns_of(rows, 3)
    assert max(map(int, speeds)) > 0
    assert "1" in lights
    assert refused == []


GARBAGE = [b"", b"\x01", bytes(3), b"GET / HTTP/1.1\r\n\r\n", bytes(range(256)), b"\xff" * 1400]


@pytest.mark.parametrize(("link_type", "options"), [(RAW_IP, ["-d", f"tcp.port=={PORT},motorcade_image"]), (USER0, [])])
def test_garbage_is_no_error_of_ours(dissect, link_type, options):
    packets = GARBAGE
    if link_type == RAW_IP:
        packets = [segments([data], PORT, client_port=10_000 + n)[0] for n, data in enumerate(GARBAGE)]
    rows = dissect(link_type, packets, ["_ws.expert.message", "_ws.lua.text", "_ws.malformed"], *options)
    assert len(rows) == len(GARBAGE)
    assert [row for row in rows if "Lua" in str(row) or row[1:] != [[], []]] == []
