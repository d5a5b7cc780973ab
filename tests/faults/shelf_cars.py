"""Cars that do what an act says, at a quiet network: they answer requests, take programs, or fail to."""

import asyncio
from binascii import crc32
from random import Random
from typing import Any

from tests.faults.loop import SimulatedLoop
from tests.faults.network import Network
from tests.faults.uploads import drawn_image
from tests.faults.world import Process, World

from motorcade.car.drive_board import DriveBoard
from motorcade.config.profile import built_in_profile
from motorcade.drive.channels import Clients
from motorcade.drive.server import serving, watched
from motorcade.drive.session import CarControl
from motorcade.timing import to_ticks
from motorcade.words.image import announced_words
from motorcade.words.packing import WORD_BYTES, unpack
from motorcade.words.request import (
    CHECK_BYTES,
    CHECK_HEADER,
    GO,
    PAYLOAD_AT,
    REQUEST_BYTES,
    STOP,
    answer_line,
    check_words,
    read_request,
    ready_line,
    split_requests,
)
from motorcade.words.upload import READBACK_REQUEST, error_line, ok_line

PORT, BAUD = 7001, 115200
# What becomes of a check request, and of an image, besides that the car does what it has to.
CHECK_FAULTS = ("mute", "busy", "old-number", "other-checksum", "noise", "hangs-up")
IMAGE_FAULTS = (
    *("mute", "stores-mute", "other-checksum", "same-length"),
    *("refuses", "cant-store", "too-large", "hangs-up", "stores-hangs-up", "other-uploader"),
)
# So many lines of its own a car says before an answer: fewer than somebody who is no car.
_TALK = 15
# After it a car's receiver begins anew.
_SILENCE_S = 0.5
PROFILE = built_in_profile("classroom")


class ShelfCar:
    """A car that answers: what it says of itself, what it holds, and what it was asked.

    Attributes:
        asked: each request's kind and name, and when it came.
        got: how many bytes of images and check requests came.
        checks, images: what becomes of the next check requests and images: faults, or nothing where all is well.
        is_mute: whether it answers nothing, or says ``murmur`` in place of an answer.
        ignores_orders: whether it does no orders, though it answers.
    """

    def __init__(self, room: World, network: Network, random: Random, host: str, name: str, port: int = PORT) -> None:
        self.world, self.network, self.random = room, network, random
        self.host, self.name, self.port = host, name, port
        self.number = random.randrange(16)
        self.role = random.choice(("leader", "follower"))
        self.board = random.choice(("simulated", "esp32", "raspberry-pi"))
        self.version = f"0.{random.randrange(9)}.1"
        self.battery_mv = random.choice((None, random.randint(3000, 9000)))
        self.held = self.first = drawn_image(random)
        self.state = "runs"
        self.asked: list[tuple[str, str, float]] = []
        self.got = 0
        self.checks: list[str] = []
        self.images: list[str] = []
        self.is_mute = self.ignores_orders = False
        self.murmur = b""
        # The kind of request at which it hangs up.
        self.hangs_up_at = ""
        # Whether it says more than it is asked.
        self.talks = False
        # At a cable: what it sends by itself, for how long, and whether it shows what it gets, as a prompt does.
        self.chatter_s = 0.0
        self.shows = False
        self.came = b""
        # Whether it got anything while it was starting.
        self.was_disturbed = False
        # Its last answer to a check request.
        self.last_ready = b""
        # A car of 2018 refuses a check request, or takes it for a program in which nothing moves.
        self.knows_no_checks = self.takes_requests = False
        # What it refuses, by the kind of a request, and why.
        self.refuses: dict[str, str] = {}
        self.lines: list[_Line] = []
        self.process: Process | None = None

    @property
    def where(self) -> str:
        return self.host if self.host.startswith("/") else f"{self.host}:{self.port}"

    def start(self) -> None:
        """Switch the car on."""
        process = self.process = Process(self.world, f"car at {self.where}", 0.001)
        loop = SimulatedLoop(process, self.network)
        self.state = "runs"

        async def serve() -> None:
            listening: Any = self.network.listen(process, self.host, self.port)
            while True:
                line, _ = await loop.sock_accept(listening)
                await loop.connect_accepted_socket(lambda: _Line(self), line)

        loop.run(serve)

    def end(self) -> None:
        """Switch it off."""
        assert self.process
        self.process.end()
        self.lines.clear()

    def kinds(self, since_s: float = 0.0) -> list[str]:
        """The kinds of the requests since a time."""
        return [kind for kind, _, at_s in self.asked if at_s >= since_s]

    def answer(self, request: Any) -> bytes:
        """Do a request, and answer it."""
        if request.kind in (STOP, GO) and not self.ignores_orders:
            self.state = "stopped" if request.kind == STOP else "runs"
        if request.kind in self.refuses:
            return error_line(self.refuses[request.kind])
        if self.is_mute or (self.ignores_orders and request.kind in (STOP, GO)):
            return self.murmur
        fields: list[tuple[str, Any]] = [("name", self.name), ("number", f"{self.number:x}"), ("role", self.role)]
        fields += [("board", self.board), ("version", self.version), ("state", self.state)]
        fields += [("words", len(self.held) // WORD_BYTES), ("holds", f"{crc32(self.held):08x}")]
        fields.append(("battery", self.battery_mv or ""))
        said = answer_line(request, tuple((key, str(value)) for key, value in fields))
        if self.talks:
            return b"temperature 21\n" * _TALK + said
        return said


class _Line(asyncio.Protocol):
    """A connection to a car."""

    def __init__(self, car: ShelfCar) -> None:
        self._car = car
        self._rest = b""
        self._starts_until_s = 0.0
        self._transport: Any = None
        # The checksum that was announced; None where none was.
        self._announced: int | None = None
        # After a refusal the rest is ignored until there was silence.
        self._skips = False
        self._last_s = 0.0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = transport
        self._car.lines.append(self)
        self._starts_until_s = self._car.world.now_s + self._car.chatter_s
        self._chatter(self._starts_until_s)

    def _chatter(self, until_s: float) -> None:
        if self._car.world.now_s < until_s and not self._transport.is_closing():
            self.send(b"temperature 21\n")
            asyncio.get_running_loop().call_later(0.15, self._chatter, until_s)

    def connection_lost(self, problem: Exception | None) -> None:
        if self in self._car.lines:
            self._car.lines.remove(self)

    def send(self, data: bytes) -> None:
        if data:
            self._transport.write(data)

    def refuse(self, reason: str) -> None:
        self._skips = True
        self.send(error_line(reason))

    def hang_up(self) -> None:
        self._transport.abort()

    def data_received(self, data: bytes) -> None:
        car = self._car
        car.came += data
        car.was_disturbed |= car.world.now_s < self._starts_until_s
        if car.shows:
            self.send(data)
            return
        uploaded, requests, rest = split_requests(self._rest + data)
        for each in requests:
            request = read_request(each)
            if request is None:
                continue
            car.asked.append((request.kind, request.name, car.world.now_s))
            if request.kind == car.hangs_up_at:
                self.hang_up()
                return
            self.send(car.answer(request))
        car.got += len(data) - REQUEST_BYTES * len(requests)
        is_silent = car.world.now_s - self._last_s >= _SILENCE_S
        if uploaded:
            self._last_s = car.world.now_s
        if self._skips and not is_silent:
            uploaded = b""
        elif uploaded:
            self._skips = False
        self._rest = self._take(uploaded) + rest

    def _take(self, data: bytes) -> bytes:
        """Take check requests, images and requests to read back; return what isn't whole."""
        while len(data) >= WORD_BYTES:
            header = unpack(data[:WORD_BYTES])
            if data.startswith(READBACK_REQUEST):
                data = data[WORD_BYTES:]
                self._read_back()
                continue
            is_check = header == CHECK_HEADER
            size = CHECK_BYTES if is_check else announced_words(header) * WORD_BYTES
            fault = (self._car.checks if is_check else self._car.images)[:1]
            if not is_check and fault == ["hangs-up"] and len(data) * 2 > size:
                self._car.images.pop(0)
                self.hang_up()
                return b""
            if len(data) < size:
                break
            if is_check:
                self._check(data[:size])
            else:
                self._store(data[:size])
            data = data[size:]
        return data

    def _read_back(self) -> None:
        fault = (self._car.images or [""]).pop(0)
        data = self._car.held
        if fault == "damages":
            # The last byte of each word of a program is 0. A program of one word is cut.
            data = data[:-1] + b"\1" if len(data) > WORD_BYTES else data[:-1]
        if fault != "mute":
            self.send(data)

    def _check(self, request: bytes) -> None:
        car = self._car
        if car.knows_no_checks:
            if car.takes_requests:
                car.held = request
                self.send(ok_line(request))
            else:
                self.refuse(f"image-header word=0x{CHECK_HEADER:08x}")
            return
        fault = (car.checks or [""]).pop(0)
        words = [unpack(request[at : at + WORD_BYTES]) for at in range(WORD_BYTES, CHECK_BYTES, WORD_BYTES)]
        *checksum, number = [word >> PAYLOAD_AT & 255 for word in words]
        announced = int.from_bytes(bytes(checksum))
        if fault == "":
            self._announced = announced
            car.last_ready = ready_line(check_words(announced, number), car.held)
            self.send(car.last_ready)
        elif fault == "busy":
            self.refuse("busy")
        elif fault == "old-number":
            self.send(ready_line(check_words(announced, number - 1 & 255), car.held))
        elif fault == "last-answer":
            # What it said of another request comes once more, and nothing of this one.
            self.send(car.last_ready)
        elif fault == "other-checksum":
            self.send(ready_line(check_words(announced ^ 1, number), car.held))
        elif fault == "noise":
            self.send(car.random.randbytes(20).replace(b"E", b"e") + b"\n")
        elif fault == "hangs-up":
            self.hang_up()

    def _store(self, image: bytes) -> None:
        car, fault = self._car, (self._car.images or [""]).pop(0)
        announced, self._announced = self._announced, None
        if fault in ("", "stores-mute", "stores-hangs-up") and announced in (None, crc32(image)):
            car.held = image
            if fault == "stores-hangs-up":
                self.hang_up()
            elif not fault:
                self.send(ok_line(image))
        elif fault == "other-uploader":
            # Another computer was faster, and this one hears nothing.
            car.held = drawn_image(car.random)
        elif fault in ("", "refuses"):
            self.refuse(f"the checksum is {crc32(image) ^ 1:08x}, {announced or 0:08x} was announced")
        elif fault in ("other-checksum", "same-length"):
            # It has stored what has as many words, or fewer, where nothing was announced.
            other = bytes(image[:-2]) + bytes([image[-2] ^ 16]) + image[-1:]
            other = other if fault == "same-length" else other[: 1 * WORD_BYTES]
            if announced is None:
                car.held = other
            self.send(ok_line(other))
        elif fault == "cant-store":
            self.refuse("the image could not be stored")
        elif fault == "too-large":
            self.refuse(f"image-too-large words={len(image) // WORD_BYTES} most=4")


class ShelfDriveCar(DriveBoard):
    """A drive server: its state is what its telemetry tells."""

    switches = ()

    def __init__(self, room: World, network: Network, host: str, port: int = 5005, telemetry: int = 5006) -> None:
        self.world, self.network, self.host, self.port, self.telemetry = room, network, host, port, telemetry
        self.control: CarControl | None = None
        self.process: Process | None = None
        self.mv = 7200

    @property
    def where(self) -> str:
        return f"drive://{self.host}:{self.port}"

    @property
    def state(self) -> str:
        assert self.control
        return self.control.telemetry().state

    def start(self) -> None:
        process = self.process = Process(self.world, f"drive server at {self.host}", 0.001)
        loop = SimulatedLoop(process, self.network)

        async def serve() -> None:
            control = self.control = CarControl(self, lambda: to_ticks(loop.time()), PROFILE)
            at = (self.port, self.telemetry)
            sockets: list[Any] = [self.network.listen(process, self.host, port) for port in at]
            async with watched(control), serving(Clients(control), *sockets):
                await asyncio.Event().wait()

        loop.run(serve)

    def end(self) -> None:
        assert self.process
        self.process.end()

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        pass

    def neutral(self) -> None:
        pass

    def battery_mv(self) -> int | None:
        return self.mv
