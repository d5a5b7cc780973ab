"""Hostile peers of a room of cars, which are well-formed: what they announce, what they answer, what a list may hold.

None of them may hide a car, take its name, keep others waiting, cost more than a share, or have a file opened.
"""

import unicodedata
from binascii import crc32
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from random import Random
from typing import Any

from serial import Serial, SerialException, SerialTimeoutException
from tests.faults.network import ListeningSocket, Socket
from tests.faults.selector import Selector
from tests.faults.world import Process, World, current, world

from motorcade.fleet.places import CAR, CLASS, DRIVE, STUDIO
from motorcade.words.request import REQUEST_BYTES, read_request

# For each byte that comes a program may move so many, beside what an upload has.
_MOST_MOVED, _FREE_BYTES = 64, 1 << 19
_LIAR_PORT = 7001
# A car's text that is no name: it would change what a terminal shows.
HOSTILE_TEXTS = ("\x1b]0;x\x07", "\x1b[2J", "a\u202eb", "x" * 300, "a\tb", "\u200b")
# pyserial opens each of these, and some of them write a file.
URLS = (
    *(
        "spy:///dev/ttyUSB0?file=/home/ada/thesis.odt",
        "spy://loop://?file=/x",
        "alt:///dev/ttyUSB0?class=PosixPollSerial",
    ),
    *("loop://", "hwgrep://.*", "cp2110://0001", "rfc2217://10.0.0.2:7001", "SPY:///dev/ttyS0?file=/x"),
)


class Moved(bytes):
    """Bytes of a peer, which count what a program copies of them: work that doesn't depend on the computer."""

    @staticmethod
    def _count(data: bytes) -> "Moved":
        room = current()
        if room is not None:
            room.moved_bytes += len(data)
        return Moved(data)

    def __add__(self, other: Any) -> bytes:
        return self._count(bytes(self) + bytes(other)) if isinstance(other, bytes) else bytes.__add__(self, other)

    def __radd__(self, other: Any) -> bytes:
        return self._count(bytes(other) + bytes(self))

    def __getitem__(self, key: Any) -> Any:
        found = bytes.__getitem__(self, key)
        return self._count(found) if isinstance(found, bytes) else found

    def split(self, *arguments: Any) -> Any:
        room = current()
        if room is not None:
            room.moved_bytes += len(self)
        return [Moved(piece) for piece in bytes.split(self, *arguments)]

    def partition(self, separator: Any) -> Any:
        return tuple(self._count(piece) for piece in bytes.partition(self, separator))


def check_work(room: World, received: Callable[[], int]) -> Callable[[], None]:
    """Return a check that a program moves few bytes for each one that has come since the last check."""
    before = [0, 0]

    def check() -> None:
        came, moved = received(), room.moved_bytes
        new, done = came - before[0], moved - before[1]
        before[:] = came, moved
        most = _FREE_BYTES + _MOST_MOVED * new
        room.keep("work-bounded", done <= most, "{} bytes are moved for {} that came", done, new)

    return check


class Liar:
    """A peer that accepts connections at a place of its own, and answers as it likes.

    Args:
        run: the room.
        host: where it is.
        claims: the name of a real car, which it calls its own.
    """

    def __init__(self, run: Any, host: str, claims: str) -> None:
        self.run = run
        self.host = host
        self.random = Random(f"{run.world.seed} {host}")
        self.claims = claims
        self.is_sent = False
        self.kind = self.random.choice(("newlines", "endless", "names", "echo", "errors", "mute", "closes", "answers"))
        self.process = Process(run.world, f"liar {host}", 0.001)
        run.network.link(f"teacher to {host}", 0.002)
        run.world.count(f"liar {self.kind}")
        self.process.start(self._serve)

    def _serve(self) -> None:
        room, selector = self.run.world, Selector(self.run.world)
        listening: ListeningSocket = self.run.network.listen(self.process, self.host, _LIAR_PORT)
        selector.register(listening, 1)
        lines: list[Socket] = []
        while True:
            selector.select(0.02 if lines else 1.0)
            while listening.is_readable:
                line = listening.accept()[0]
                if self.kind == "closes":
                    line.close()
                else:
                    lines.append(line)
            lines = [line for line in lines if not (line.error or line.has_ended or line.is_closed)]
            for line in lines:
                self._lie(line)
            if room.is_healed and self.kind in ("newlines", "endless", "answers"):
                self.kind = "mute"

    def _lie(self, line: Socket) -> None:
        came = bytes(line.received)
        if came:
            line.skip(len(came))
        data = b""
        request = read_request(came[:REQUEST_BYTES]) if len(came) >= REQUEST_BYTES else None
        # As a car until it is sent a program.
        self.is_sent |= bool(came) and request is None
        if self.kind in ("newlines", "endless") and self.is_sent:
            data = (b"\n" if self.kind == "newlines" else b"x") * 30_000
        elif self.kind == "errors":
            data = b"ERR " + self.random.choice(HOSTILE_TEXTS).encode() + b"\n"
        elif self.kind == "echo":
            data = came
        elif request and self.kind in ("names", "newlines", "endless"):
            data = self._answer(request.kind, request.number)
        elif self.kind == "answers":
            data = b"".join(self._answer("a", f"{number:02x}") for number in range(256))
        if data:
            with suppress(OSError):
                line.send(data)

    def _answer(self, kind: str, number: str) -> bytes:
        name = self.random.choice((self.claims, "all", *HOSTILE_TEXTS)).replace(" ", "_")
        text = (
            f"OK car={kind}{number} name={name} number=0 role=leader board={name} state={name} words=9 holds=00000000"
        )
        return text.encode() + f" sum={crc32(text.encode()):08x}\n".encode()


def announcements(run: Any) -> tuple[list[tuple[str, str, int, str]], bool]:
    """What hostile hosts announce: names, hosts, ports and kinds; and whether it is too much to believe all of it."""
    random: Random = run.random
    places: list[tuple[str, str, int, str]] = []
    cars = list(run.cars[run.listed :])
    is_flood = False
    for number, car in enumerate(cars):
        if random.random() < 0.5:
            kind = random.choice((CLASS, STUDIO, DRIVE, DRIVE, "", "toaster"))
            places.append((f"spoof {number}.", car.host, car.port, kind))
        if random.random() < 0.15:
            # The port behind it, as that of a drive server.
            places.append((f"behind {number}.", car.host, car.port - 1, DRIVE))
    if cars and random.random() < 0.15:
        # So many records for its host that the real one is one too many.
        host = random.choice(cars).host
        places += [(f"crowd {number}.", host, 2000 + number, random.choice((CAR, DRIVE))) for number in range(66)]
        is_flood = True
    if random.random() < 0.5:
        places.append(("elsewhere.", random.choice(("8.8.8.8", "2001:4860:4860::8888")), 7001, CAR))
    return places, is_flood


def check_text(room: World, what: str, text: str) -> None:
    """What a stranger says changes no line of a terminal and no table."""
    hostile = [each for each in text if unicodedata.category(each)[0] == "C"]
    room.keep("safe-text", not hostile and len(text) <= 300, f"{what} shows {text!r}")


class Opened:
    """pyserial, which notes what is opened: only devices and ``socket://`` may be."""

    SerialException, SerialTimeoutException, Serial = SerialException, SerialTimeoutException, Serial

    def __init__(self, opened: Callable[..., Any] | None = None) -> None:
        self._opened = opened

    def serial_for_url(self, port: str, **options: object) -> Any:
        is_device = ("://" not in port or port.startswith("socket://")) and not Path(port).is_file()
        world().keep("only-ports", is_device and not Path(port).is_dir(), f"{port} is opened")
        world().keep("only-ports", options.get("exclusive") is True, f"{port} is opened, and shared")
        if self._opened is None:
            raise SerialException(f"could not open port {port}: no such file")
        return self._opened(port, **options)
