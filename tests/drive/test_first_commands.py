"""Whom a car without keys believes: what other programs send moves no wheel, and who drives is told from them."""

import itertools
import random
import re
import socket
import struct
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from motorcade.drive.stamps import stamp_at
from motorcade.words.formats import DRIVE, LIGHTS
from support.driven_car import PATIENT, STEADY, DrivenCar
from support.soak import SOAK
from support.socketless_car import SocketlessCar, ask, command, receive
from support.waiting import DEADLINE_S, wait_until

MESSAGES = 100_000 if SOAK else 10_000


def tls(dice: random.Random) -> bytes:
    """A ClientHello, whose record has any version and any length that clients have."""
    hello = b"\x03\x03" + dice.randbytes(32) + b"\x20" + dice.randbytes(32) + dice.randbytes(dice.randrange(2000))
    record = b"\x01" + len(hello).to_bytes(3, "big") + hello
    return b"\x16\x03" + bytes([dice.randrange(5)]) + len(record).to_bytes(2, "big") + record


def http(dice: random.Random) -> bytes:
    method = dice.choice(["GET", "POST", "HEAD", "PUT", "OPTIONS", "DELETE", "PRI", "CONNECT"])
    return f"{method} /{dice.randrange(1000)} HTTP/1.1\r\nHost: car\r\n\r\n".encode()


def ssh(dice: random.Random) -> bytes:
    return f"SSH-2.0-OpenSSH_9.{dice.randrange(9)}\r\n".encode()


def mqtt(dice: random.Random) -> bytes:
    name = dice.randbytes(dice.randrange(100)).hex().encode()
    body = b"\x00\x04MQTT\x04\x02\x00\x3c" + len(name).to_bytes(2, "big") + name
    length = bytes([len(body)]) if len(body) < 128 else bytes([len(body) & 127 | 128, len(body) >> 7])
    return b"\x10" + length + body


def modbus(dice: random.Random) -> bytes:
    return struct.pack(">HHHBBHH", dice.randrange(1 << 16), 0, 6, 1, dice.randrange(1, 7), dice.randrange(100), 1)


def protobuf(dice: random.Random) -> bytes:
    """Fields of ascending numbers, each a small number or a text; perhaps behind its length."""
    data = b""
    for number in sorted(dice.sample(range(1, 16), dice.randrange(3, 9))):
        if dice.random() < 0.5:
            data += bytes([number << 3, dice.randrange(128)])
        else:
            text = dice.randbytes(dice.randrange(20))
            data += bytes([number << 3 | 2, len(text)]) + text
    return bytes([len(data) & 127]) + data if dice.random() < 0.5 else data


def msgpack(dice: random.Random) -> bytes:
    return b"".join(
        dice.choice([bytes([dice.randrange(128)]), b"\xa4" + dice.randbytes(4), b"\xc0", b"\x92"]) for _ in range(20)
    )


def redis(dice: random.Random) -> bytes:
    return b"*1\r\n$4\r\nPING\r\n" * dice.randrange(1, 4)


def sip(dice: random.Random) -> bytes:
    return f"REGISTER sip:{dice.randrange(99)} SIP/2.0\r\nVia: SIP/2.0/TCP car\r\n\r\n".encode()


def framed(dice: random.Random) -> bytes:
    """A length of two or four bytes, in either order, and so many bytes."""
    body = dice.randbytes(dice.randrange(9, 300))
    return struct.pack(dice.choice([">I", "<I", ">H", "<H"]), len(body)) + body


def made_up(dice: random.Random) -> bytes:
    return dice.randbytes(dice.randrange(5, 64))


def nearly(dice: random.Random) -> bytes:
    """Begins like a command."""
    return bytes([dice.randrange(0x10, 0x1C)]) + dice.randbytes(dice.randrange(7, 40))


PROTOCOLS = (tls, http, ssh, mqtt, modbus, protobuf, msgpack, redis, sip, framed, made_up, nearly)


def pieces(data: bytes, dice: random.Random) -> Iterator[bytes]:
    """Cut a message at any places."""
    cuts = sorted({0, len(data), *(dice.randrange(len(data)) for _ in range(dice.randrange(4)))})
    for begin, end in itertools.pairwise(cuts):
        yield data[begin:end]


@pytest.mark.parametrize("byte_order", ["big", "little"])
@pytest.mark.parametrize("message", PROTOCOLS)
def test_first_messages_of_other_programs_move_no_wheel_however_they_are_cut(
    message: Callable[[random.Random], bytes], byte_order: str
) -> None:
    dice = random.Random(f"{message.__name__} {byte_order}")
    car = SocketlessCar(byte_order)
    for number in range(MESSAGES // len(PROTOCOLS)):
        channel, line = car.commands(number)
        for piece in pieces(message(dice), dice):
            if line.is_open:
                receive(channel, piece)
                car.wait(dice.randrange(40))
        car.wait(50)
        assert car.board.applied == []
        line.abort()


@pytest.mark.parametrize("message", [tls, http, ssh, mqtt, redis, sip])
def test_the_beginning_alone_of_a_message_moves_no_wheel(message: Callable[[random.Random], bytes]) -> None:
    dice = random.Random(message.__name__)
    car = SocketlessCar("big")
    for number in range(MESSAGES // 10):
        data = message(dice)
        channel, line = car.commands(number)
        receive(channel, data[: dice.randrange(1, min(len(data), 40))])
        car.wait(1000)
        assert car.board.applied == []
        line.abort()


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (tls(random.Random(1)), "speaks TLS: this car takes no keys"),
        (b"GET / HTTP/1.1\r\n", "speaks HTTP"),
        (b"SSH-2.0-x\r\n", "speaks SSH"),
        (command(90, 100)[::-1] * 3, r"sent 3 words that are no commands (code is 0"),
        (command(90, 100)[::-1], "--byte-order little"),
        (b"hello you", "begins with hello yo"),
        (b"\xff\xfe\x00\x00", "begins with ff fe 00 00"),
        (struct.pack(">I", DRIVE.encode(speed=1) | 7), "stamped commands begin with speed 0"),
    ],
)
def test_the_console_says_once_who_a_stranger_is(data: bytes, says: str) -> None:
    car = SocketlessCar()
    for port in range(50):
        channel, line = car.commands(port)
        receive(channel, data)
        assert not line.is_open
    (said,) = car.said
    assert said.startswith("192.168.1.7:0 ")
    assert says in said
    assert car.control.telemetry().turned_away == 50
    car.wait(61_000)
    receive(car.commands(99)[0], data)
    assert len(car.said) == 2


def test_many_strangers_do_not_fill_the_console() -> None:
    car = SocketlessCar()
    for number in range(1000):
        receive(car.commands(1, f"10.0.{number // 250}.{number % 250}")[0], b"GET / ")
    assert 0 < len(car.said) <= 20


def test_strangers_at_the_port_for_telemetry_are_named_too() -> None:
    car = SocketlessCar()
    for data, says in ((tls(random.Random(1)), "speaks TLS"), (command(90, 9), "another port for commands")):
        channel, line = car.telemetry()
        channel.data_received(data)
        assert not line.is_open
        assert says in car.said[-1]


def test_one_command_is_obeyed_when_nothing_follows_it_for_50_ms() -> None:
    car = SocketlessCar()
    channel, _ = car.commands()
    receive(channel, command(40, 150))
    car.wait(49)
    assert car.board.angles == []
    car.wait(1)
    assert car.board.angles == [40]


def test_a_first_command_that_arms_the_car_counts_though_the_next_one_comes_within_50_ms() -> None:
    car = SocketlessCar()
    channel, line = car.commands()
    receive(channel, command(90, 100) * 2)
    line.abort()
    assert car.control.telemetry().state == "failsafe"
    channel, _ = car.commands()
    receive(channel, command(91, 0))
    car.wait(40)
    receive(channel, command(92, 100))
    assert car.control.telemetry().state == "moving"


def test_a_slow_network_that_cuts_commands_in_pieces_delays_them_and_no_more() -> None:
    car = SocketlessCar()
    channel, _ = car.commands()
    for byte in command(40, 150) + command(41, 150):
        assert car.board.angles == []
        receive(channel, bytes([byte]))
        car.wait(30)
    assert car.board.angles == [40, 41]


def test_all_commands_of_a_burst_count_as_ever_and_one_alone_that_hangs_up_is_told() -> None:
    car = SocketlessCar()
    channel, line = car.commands()
    receive(channel, command(10, 100) * 9 + command(20, 100))
    assert car.board.angles == [20]
    line.abort()
    assert car.control.telemetry().state == "failsafe"
    channel, line = car.commands()
    receive(channel, command(10, 0))
    line.abort()
    assert car.board.angles == [20]
    assert "hung up at once" in car.said[-1]


def test_a_client_that_begins_with_the_lights_is_believed() -> None:
    car = SocketlessCar()
    channel, line = car.commands()
    receive(channel, struct.pack(">I", LIGHTS.encode(horn=1)) + command(20, 100))
    assert line.is_open
    assert car.board.angles == [20]


def test_stamped_commands_move_nothing_until_the_clock_is_answered() -> None:
    """What fills the bits that are 0 otherwise may be another program's data."""
    car = SocketlessCar("big")
    channel, line = car.commands()
    for number in range(60):
        stamp = stamp_at(car.now_ms)
        receive(channel, struct.pack(">I", DRIVE.encode(speed=0 if number < 2 else 100) | stamp))
        car.wait(50)
    assert line.is_open
    assert car.board.applied == []
    assert "answer to the car's clock" in car.said[-1]
    telemetry, answers = car.telemetry()
    ask(telemetry, answers, do="join", port=1000)
    car.tell()
    clock = answers.frames()[-1]["you"]["clock"]
    ask(telemetry, answers, do="sync", clock=clock, words=60, stamp=stamp_at(car.now_ms))
    receive(channel, struct.pack(">I", DRIVE.encode(direction=1, speed=100) | stamp_at(car.now_ms)))
    assert car.board.applied == [(90, 1, 100)]


@pytest.mark.parametrize(
    ("state", "says"),
    [
        ("failsafe", "waits for a command with speed 0"),
        ("stopped", "emergency stop holds"),
        ("driven", "another client drives"),
        ("discharged", "the battery is low"),
        ("dark", "switches something that this car doesn't have"),
    ],
)
def test_the_console_says_at_once_and_once_why_commands_do_nothing(state: str, says: str) -> None:
    car = SocketlessCar()
    first, line = car.commands(1, "192.168.1.8")
    receive(first, command(90, 100) * 2)
    if state != "driven":
        line.abort()
    if state == "stopped":
        car.control.change(None, lambda arbiter, now: arbiter.stop())
    if state == "discharged":
        car.control.change(None, lambda arbiter, now: arbiter.discharge())
    channel, _ = car.commands(2)
    commands = command(91, 100) * 2
    if state == "dark":
        receive(channel, command(90) * 2)
        commands = struct.pack(">I", LIGHTS.encode(horn=1))
    receive(channel, commands)
    (said,) = car.said
    assert said.startswith("192.168.1.7:2 ")
    assert says in said
    for _ in range(9):
        receive(channel, commands)
        car.wait(20)
    assert car.said == [said]


def test_the_console_says_at_once_and_once_that_there_are_too_many_commands() -> None:
    car = SocketlessCar()
    channel, _ = car.commands()
    receive(channel, command(90) * 2)
    for _ in range(150):
        receive(channel, command(91, 100))
        assert bool(car.said) == (channel.session.counts["over-rate"] > 0)
    (said,) = car.said
    assert channel.session.counts["over-rate"] > 9
    assert "more commands than the car takes" in said


def client_in(page: Path) -> str:
    """The client that a page of the documentation has."""
    (found,) = re.findall(r"```python\n(import socket\n.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    return str(found)


@pytest.mark.parametrize("page", ["drive.md", "drive.zh.md"])
def test_the_client_in_the_documentation_drives_a_car_each_time(page: str) -> None:
    program = client_in(Path(__file__).parents[2] / "docs" / page)
    with DrivenCar(profile=STEADY) as car:
        for _ in range(2):
            begin = len(car.board.notes)
            exec(program.replace("5005", str(car.port)), {})
            wait_until(lambda: not car.server.commands)
            assert car.board.was_told((40, 1, 150), begin)
            assert car.control.telemetry().state == "ready"


def test_the_seed_s_own_client_moves_a_car_by_one_native_int() -> None:
    """Seed 001 sends the int of createCmd as it is in the memory of an ARM or x86 processor."""
    code, angle, direction, speed = 1, 40, 1, 150
    sent = ((code << 17) | (angle << 9) | (direction << 8) | speed) << 11
    with DrivenCar(byte_order="little", profile=PATIENT) as car:
        with socket.create_connection(("127.0.0.1", car.port), DEADLINE_S) as line:
            line.sendall(struct.pack("<i", sent))
            wait_until(lambda: car.board.setpoint == (40, 1, 150))
        wait_until(lambda: not car.board.moves)
