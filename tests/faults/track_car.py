"""A car in a quiet simulated room, its hardware, and clients that speak bytes at both of its ports."""

import asyncio
import json
import struct
from collections import deque
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from random import Random
from typing import Any

from tests.faults.loop import SimulatedLoop
from tests.faults.network import Network
from tests.faults.world import Process, World

from motorcade.car.drive_board import DriveBoard
from motorcade.config.profile import built_in_profile
from motorcade.drive.channels import Clients
from motorcade.drive.server import serving, watched
from motorcade.drive.session import CarControl
from motorcade.timing import to_ticks

COMMANDS, TELEMETRY = 5005, 5006
NEUTRAL = (90, 1, 0)
# The profile's limits, as docs/drive.md has them; and what a car and its clock's steps take beside the network.
FAILSAFE_S, WATCHDOG_S, HAND_OVER_S, STALE_S, OWN_S = 0.300, 0.200, 5.0, 0.150, 0.015
PERIOD_S = 0.1
MOVE, SWITCH = 1 << 28, 2 << 28
HEAD_LIGHT, HORN = 1 << 27, 1 << 26
_PROFILE = built_in_profile("classroom")
_STEP_MS, _STEPS = 4, 2047

Setpoint = tuple[int, int, int]


def move(setpoint: Setpoint) -> int:
    """The command of an angle, a direction and a speed."""
    angle, direction, speed = setpoint
    return MOVE | angle << 20 | direction << 19 | speed << 11


class TrackBoard(DriveBoard):
    """Hardware that notes what it is told, and when; it may fail, hang, see an obstacle, and have a program.

    Attributes:
        applied: each setpoint, and when it came.
        switched: each switch, whether it is on, and when that came.
        fails, switch_fails: how many of the next calls for wheels, and for switches, fail.
    """

    def __init__(self, room: World, has_program: bool, switches: tuple[str, ...]) -> None:
        self._room = room
        self.has_program = has_program
        self.switches = switches
        self.setpoint: Setpoint = NEUTRAL
        self.applied: list[tuple[Setpoint, float]] = []
        self.switched: list[tuple[str, bool, float]] = []
        self.is_on = dict.fromkeys(switches, False)
        self.voltage_mv: int | None = None
        self.distance_mm: int | None = None
        self.fails = self.switch_fails = 0
        self.battery_fails = False
        self.runs = self.is_closed = self.is_broken = False

    @property
    def speed(self) -> int:
        return self.setpoint[2]

    def _operate(self) -> None:
        if self.fails:
            self.fails -= 1
            self._room.count("hardware fails")
            raise OSError("the chip gives no answer")

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        self._operate()
        self.setpoint = angle_deg, direction, speed
        self.applied.append((self.setpoint, self._room.now_s))
        self._room.note("apply", *self.setpoint)

    def neutral(self) -> None:
        self._operate()
        self.setpoint = NEUTRAL
        self._room.note("neutral")

    def battery_mv(self) -> int | None:
        if self.battery_fails:
            raise OSError("no voltage")
        return self.voltage_mv

    def obstacle_mm(self) -> int | None:
        return self.distance_mm

    def set_switch(self, name: str, is_on: bool) -> None:
        if self.switch_fails:
            self.switch_fails -= 1
            raise OSError("the lamp gives no answer")
        self.is_on[name] = is_on
        self.switched.append((name, is_on, self._room.now_s))
        self._room.note("switch", name, is_on)

    def begin_program(self) -> None:
        self.runs = True

    def check_program(self) -> None:
        if self.is_broken:
            raise OSError("the program hangs")

    def end_program(self) -> None:
        self.runs = False

    def close(self) -> None:
        self.is_closed = True
        self.neutral()


class TrackClient:
    """A client that speaks bytes: a connection for commands, one for telemetry, or both.

    Attributes:
        delay_s: what the network takes each way.
        told: the newest telemetry.
        sent: how many commands were sent.
        has_ended: whether the car has hung up the connection for commands.
    """

    def __init__(self, run: "Track", address: str, delay_s: float) -> None:
        self._run = run
        self.address, self.delay_s = address, delay_s
        self.told: dict[str, Any] = {}
        self.told_s: list[float] = []
        self.sent = 0
        self.port = 0
        self.has_ended = self.is_hung_up = False
        self._answers: deque[asyncio.Future[dict[str, Any]]] = deque()
        self.answers: list[dict[str, Any]] = []
        self._writers: dict[int, asyncio.StreamWriter] = {}
        self._tasks: list[asyncio.Task[None]] = []

    @property
    def you(self) -> dict[str, Any]:
        return self.told.get("you") or {}

    @property
    def name(self) -> str:
        return f"{self.address}:{self.port}"

    async def call(self, port: int) -> "TrackClient":
        """Connect to one of the car's ports."""
        reader, writer = await asyncio.open_connection("car", port, local_addr=(self.address, 0))
        self._writers[port] = writer
        if port == COMMANDS:
            self.port = writer.get_extra_info("sockname")[1]
        listen = self._listen(reader) if port == TELEMETRY else self._wait_for_end(reader)
        self._tasks.append(asyncio.create_task(listen))
        return self

    async def _wait_for_end(self, reader: asyncio.StreamReader) -> None:
        with suppress(OSError):
            while await reader.read(100):
                pass
        self.has_ended = True

    async def _listen(self, reader: asyncio.StreamReader) -> None:
        with suppress(OSError, asyncio.IncompleteReadError):
            while True:
                (size,) = struct.unpack(">I", await reader.readexactly(4))
                frame = json.loads(await reader.readexactly(size))
                if frame["kind"] == "telemetry":
                    self.told = frame
                    self.told_s.append(self._run.world.now_s)
                else:
                    self.answers.append(frame)
                    if frame["do"] not in (None, "join") and self._answers:
                        self._answers.popleft().set_result(frame)
        self.is_hung_up = True

    def stamp(self, age_s: float = 0.0) -> int:
        """The stamp of what was sent so long ago."""
        return 1 + int((self._run.world.now_s - age_s) * 1000) // _STEP_MS % _STEPS

    def send(self, *words: int, stamped: bool = False, age_s: float = 0.0) -> None:
        """Send commands at once."""
        stamp = self.stamp(age_s) if stamped else 0
        self._writers[COMMANDS].write(b"".join(struct.pack(">I", word | stamp) for word in words))
        self.sent += len(words)

    def send_bytes(self, data: bytes, port: int = COMMANDS) -> None:
        self._writers[port].write(data)

    def post(self, do: str, **more: Any) -> None:
        """Send a request whose answer nobody waits for."""
        text = json.dumps({"do": do} | more).encode()
        self._writers[TELEMETRY].write(struct.pack(">I", len(text)) + text)
        if do != "join":
            self._answers.append(asyncio.get_running_loop().create_future())

    async def ask(self, do: str, **more: Any) -> dict[str, Any]:
        """Send a request, and return its answer."""
        self.post(do, **more)
        waiting = self._answers[-1]
        async with asyncio.timeout(3.0):
            return await waiting

    async def arrive(self, seconds: float = 0.0) -> None:
        """Wait until what was sent has arrived, and the car has had its turn; and so long besides."""
        await asyncio.sleep(self.delay_s + OWN_S + seconds)

    async def settle(self) -> None:
        """Wait until the next telemetry has come whole, of what is now."""
        await asyncio.sleep(2 * self.delay_s + PERIOD_S + 2 * OWN_S)

    async def come(self, stamped: bool = False) -> "TrackClient":
        """Connect to both ports as a client does: arm the car, and answer its clock where commands are stamped."""
        await self.call(TELEMETRY)
        await self.call(COMMANDS)
        self.post("join", port=self.port)
        self.send(move(NEUTRAL), move(NEUTRAL), stamped=stamped)
        await self.settle()
        if stamped:
            await self.answer_clock()
            self.send(move(NEUTRAL), stamped=True)
            await self.arrive()
        return self

    async def answer_clock(self, under_way: int = 0) -> None:
        """Answer the car's clock as it is told next, while so many commands are still under way."""
        await self.settle()
        clock = self.you.get("clock")
        self._run.keep("no-old-command", clock is not None, "the car asks for no clock before it believes stamps")
        self.post("sync", clock=clock, words=self.sent + under_way, stamp=self.stamp())
        await self.arrive()

    def close(self) -> None:
        for task in self._tasks:
            task.cancel()
        for writer in self._writers.values():
            writer.transport.abort()
        self._writers.clear()


class Track:
    """One run: cars, one after the other, and those who come to each."""

    def __init__(self, room: World) -> None:
        self.world = room
        self.keep = room.keep
        self.random = Random(f"{room.seed} plan")
        self.network = Network(room)
        self.people = Process(room, "people", 0.001)
        self.network.link("people", 0.002)
        self.records: list[tuple[str, str]] = []
        # What the car's console says: to whom it is refused what, and why.
        self.said: list[str] = []
        self.board = TrackBoard(room, False, ())
        self.loop: SimulatedLoop | None = None
        self.clients: list[TrackClient] = []
        self.top_speed_mm_s = _PROFILE.speeds_mm_s[-1]
        self._addresses = 0

    @asynccontextmanager
    async def car(
        self, has_program: bool = False, switches: tuple[str, ...] = ("head_light", "horn"), **limits: Any
    ) -> AsyncIterator[TrackBoard]:
        """Run a car while the block runs; then all leave, and its wheels stand, and its hardware is free."""
        process = Process(self.world, "car", 0.001)
        process.offset_s = self.random.uniform(0, 1e6)
        loop = self.loop = SimulatedLoop(process, self.network)
        board = self.board = TrackBoard(self.world, has_program, switches)
        self.records.clear()
        self.said.clear()
        profile = replace(_PROFILE, drive=replace(_PROFILE.drive, **limits))
        ending = asyncio.Event()

        async def serve() -> None:
            control = CarControl(board, lambda: to_ticks(loop.time()), profile)
            control.record = lambda did, who: self.records.append((did, who))
            sockets: list[Any] = [self.network.listen(process, "car", port) for port in (COMMANDS, TELEMETRY)]
            clients = Clients(control)
            clients.refusals.say = lambda phrase: self.said.append(phrase.sentence())
            async with watched(control), serving(clients, *sockets):
                await ending.wait()

        loop.run(serve)
        await asyncio.sleep(0.2)
        yield board
        if self.clients and self.random.random() < 0.5:
            for client in self.clients:
                client.close()
            await asyncio.sleep(0.2)
            self.keep("gone-stops", board.speed == 0, "the wheels turn when all have left")
        loop.soon(ending.set)
        await asyncio.sleep(0.5)
        self.keep("gone-stops", board.speed == 0 and board.is_closed, "a server that ends leaves wheels that turn")
        self.keep("horn-ends", not board.is_on.get("horn"), "a server that ends leaves a horn that sounds")
        for client in self.clients:
            client.close()
        self.clients.clear()
        self.network.watch = lambda name, port, socket: None
        process.end()

    def client(self, address: str = "") -> TrackClient:
        """Somebody at an address of their own, unless one is given."""
        self._addresses += 1
        at = address or f"10.0.{self._addresses // 200}.{self._addresses % 200 + 1}"
        link = self.network.links.get(at) or self.network.link(at, self.random.choice((0.002, 0.01, 0.03)))
        self.clients.append(TrackClient(self, at, link.delay_s))
        return self.clients[-1]

    def setpoint(self, speed: int | None = None) -> Setpoint:
        """A command that moves the wheels."""
        random = self.random
        return random.randint(0, 180), random.randrange(2), speed or random.randint(1, 255)

    async def drive_on(self, driver: TrackClient, seconds: float, stamped: bool = False) -> Setpoint:
        """Move the wheels for a time, as a client that renews its command; return the last command."""
        end_s, setpoint = self.world.now_s + seconds, self.setpoint()
        while self.world.now_s < end_s:
            setpoint = self.setpoint()
            driver.send(move(setpoint), stamped=stamped)
            await asyncio.sleep(0.05)
        await driver.arrive()
        return setpoint
