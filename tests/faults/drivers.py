"""Those who are connected to the simulated car: drivers with Motorcade's client, one who stops, and strangers."""

import asyncio
import json
import struct
from contextlib import suppress
from random import Random
from typing import Any

from tests.faults.loop import SimulatedLoop
from tests.faults.network import Socket
from tests.faults.wheels import FAILSAFE_S, fields
from tests.faults.world import Process

from motorcade.drive.client import DriveClient
from motorcade.drive.wire import pack_word, stick_word
from motorcade.errors import DriveError

_COMMANDS, _TELEMETRY = 5005, 5006
_PERIOD_S = 0.06
_ANGLES, _SPEEDS = 181, 78
_HORN_BIT = 1 << 26
_STILL = struct.pack(">I", 1 << 28 | 90 << 20 | 1 << 19)


class Driver:
    """A driver: a program (``rearm``), or a person, who has to release the stick after the car stopped by itself."""

    def __init__(self, run: Any, number: int, rearm: bool) -> None:
        self.run = run
        self.number = number
        self.rearm = rearm
        self.random = Random(f"{run.world.seed} driver {number}")
        self.process = Process(run.world, f"driver {number}", self.random.choice((0.001, 0.001, 0.02)))
        self.process.offset_s = self.random.uniform(0, 1e5)
        self.client: DriveClient | None = None
        self.connection: Socket | None = None
        self._count = 0
        # Whether the network stalls when the next hold begins.
        self.stalls = False
        # The number of the present hold of the stick, and of that of each command; of the last that a connection
        # outlived, and when that broke.
        self._hold = self._broken_hold = 0
        self._broken_s = 0.0
        self._holds: dict[tuple[int, int, int], int] = {}
        # The connection by which each setpoint was sent last, and the one whose command moves the wheels.
        self._sent_by: dict[tuple[int, int, int], Socket] = {}
        self._moves: Socket | None = None
        self._over: set[Socket] = set()
        # The hold at the beginning of each connection, and when that was.
        self._begun: dict[Socket, tuple[int, float]] = {}

    def freeze(self, seconds: float | None = None) -> None:
        self.run.world.count("freeze")
        self.process.freeze(seconds or self.random.choice((0.1, 0.4, 1.0, 5.0)))

    def note_words(self, connection: Socket, data: bytes) -> None:
        """Commands are sent: remember when."""
        pins, now_s = self.run.pins, self.run.world.now_s
        if connection is not self.connection:
            self.connection = connection
            self._broken_hold, self._broken_s = self._begun[connection]
        for (word,) in struct.iter_unpack(">I", data):
            code, setpoint = fields(word)
            if code == 1 and setpoint[2]:
                first_s = pins.sent_s.get(setpoint, (now_s,))[0]
                pins.sent_s[setpoint] = first_s, now_s, self.number
                self._sent_by[setpoint] = connection
            elif code == 1:
                pins.still_sent_s[self.number] = now_s
            elif code == 2 and word & _HORN_BIT:
                pins.horn_sent_s = now_s

    def leave(self, connection: Socket) -> None:
        """A connection is over, perhaps an older one that the car misses only now: the wheel is free for others."""
        is_present = connection is self.connection
        self._over.add(connection)
        if is_present:
            self._break()
        self.run.pins.leave(self.number, is_present, connection is self._moves)

    def connect(self, connection: Socket) -> None:
        """A connection begins, perhaps one that its client has given up meanwhile: then it never sends anything."""
        self._begun[connection] = self._hold, self.run.world.now_s

    def _break(self) -> None:
        self._broken_hold, self._broken_s = self._hold, self.run.world.now_s

    def note_moved(self, setpoint: tuple[int, int, int]) -> None:
        """A command of this driver moves the wheels: not one of a stick that was held while the connection broke."""
        self._moves = self._sent_by[setpoint]
        # What came before the end of a connection may be done behind it, and holds the wheel for nobody.
        if self._moves in self._over:
            self.run.pins.is_free = True
        if not self.rearm:
            pins = self.run.pins
            # A car whose software doesn't run finds what came before the end of a connection only later.
            is_before = pins.is_disturbed and pins.sent_s[setpoint][1] <= self._broken_s
            is_new = self._holds[setpoint] > self._broken_hold or is_before
            self.run.world.keep("held-stick", is_new, "a stick that was held while the connection broke moves the car")

    def start(self) -> None:
        SimulatedLoop(self.process, self.run.network).run(self._drive)

    async def _drive(self) -> None:
        run, random = self.run, self.random
        await asyncio.sleep(run.others_begin_s + random.uniform(0.0, 0.5))
        self.client = client = DriveClient("car", _COMMANDS, rearm=self.rearm)
        connection = client.begin
        connection()
        while not run.world.is_healed:
            await self._hold_or_rest(client)
        if self.number == 0:
            await self._drive_at_last(client)
        else:
            await asyncio.sleep(60)

    async def _hold_or_rest(self, client: DriveClient) -> None:
        """Hold the stick for a while, or leave it, or ask for something."""
        run, random = self.run, self.random
        end_s = run.world.now_s + random.uniform(0.2, 2.5)
        what = random.random()
        if what < 0.65:
            if self.stalls:
                # A stamp comes round after 8.2 s: all words of this hold may look new when they come.
                self.stalls = False
                run.network.links[self.process.name].stall(random.uniform(8.1, 8.6))
            # Between two holds the stick is at rest for a moment.
            client.steer(0.0, 0.0)
            await asyncio.sleep(0.1)
            self._hold += 1
            horn = {"horn": 1} if random.random() < 0.2 else {}
            while run.world.now_s < end_s and not run.world.is_healed:
                with suppress(DriveError):
                    client.steer(*self._position(), **horn)
                steered_s = run.world.now_s
                await asyncio.sleep(_PERIOD_S)
                # Who doesn't renew a command has released the stick.
                self._hold += run.world.now_s > steered_s + FAILSAFE_S
        elif what < 0.75:
            await asyncio.sleep(random.uniform(0.1, 0.6))
        elif what < 0.85:
            await self._honk(client, end_s)
        else:
            await self._ask(client)

    async def _honk(self, client: DriveClient, end_s: float) -> None:
        """Honk while the car stands; sometimes the program is frozen meanwhile."""
        run = self.run
        if self.random.random() < 0.3:
            run.world.after(0.3, run.world.unless_healed, lambda: self.freeze(2.5))
        while run.world.now_s < end_s and not run.world.is_healed:
            with suppress(DriveError):
                client.steer(0.0, 0.0, horn=1)
            await asyncio.sleep(_PERIOD_S)
        client.steer(0.0, 0.0)
        await asyncio.sleep(0.1)

    async def _ask(self, client: DriveClient) -> None:
        pins, what = self.run.pins, self.random.choice(("request", "release", "stop", "clear"))
        self.run.world.note(self.process.name, what)
        if what in ("request", "release"):
            # From now on the wheel may pass to another.
            pins.release(self.number) if what == "release" else pins.request(self.number)
        try:
            if what == "stop":
                await self.run.watcher.stop_with(client)
            elif what == "clear":
                await self.run.watcher.clear_with(client)
            else:
                await getattr(client, what)()
        except DriveError as problem:
            self.run.world.note(self.process.name, problem.code)
        if what == "release":
            pins.release(self.number)

    def _position(self) -> tuple[float, float]:
        """The stick's next position, which no other command has."""
        self._count += 1
        angle, step = self._count % _ANGLES, self._count // _ANGLES
        speed = 20 + step % _SPEEDS + _SPEEDS * self.number
        self._holds[angle, 1, speed] = self._hold
        return speed / 255, (90 - angle) / 90

    async def _drive_at_last(self, client: DriveClient) -> None:
        """All faults have ended: who wants to drive can, within seconds; who leaves leaves a car that stands."""
        run, pins, begin_s = self.run, self.run.pins, self.run.world.now_s
        pins.is_free = True
        while run.world.now_s < begin_s + 15:
            with suppress(DriveError):
                if not client.connected:
                    await asyncio.sleep(0.1)
                    continue
                if client.telemetry and client.telemetry.state == "stopped":
                    await run.watcher.clear_with(client)
                client.steer(*self._position())
            await asyncio.sleep(_PERIOD_S)
            pins.is_free = True
            if pins.driver == self.number and pins.setpoint[2] and pins.moved_s > begin_s:
                break
        run.world.keep("drives-again", pins.driver == self.number and pins.setpoint[2] > 0, "no drive after all faults")
        pins.is_ending = True
        await client.end()
        await asyncio.sleep(0.3)
        run.world.keep("leaves-standing", pins.setpoint[2] == 0 or pins.driver != self.number, "the wheels turn")
        run.world.is_over = True


class SeedDriver(Driver):
    """A client as that of 2018: no stamps, no telemetry, and a speed 0 only where its driver wants to stand."""

    async def _drive(self) -> None:
        run, random = self.run, self.random
        await asyncio.sleep(random.uniform(0.5, 4))
        while not run.world.is_healed:
            with suppress(OSError):
                _, writer = await asyncio.open_connection("car", _COMMANDS)
                while not run.world.is_healed and not writer.is_closing():
                    end_s = run.world.now_s + random.uniform(0.2, 2.0)
                    stands = random.random() < 0.3
                    while run.world.now_s < end_s:
                        throttle, steering = self._position()
                        writer.write(pack_word(stick_word(0.0 if stands else throttle, steering)))
                        await asyncio.sleep(0.05)
                    if random.random() < 0.2:
                        break
                    await asyncio.sleep(random.choice((0.0, 0.4, 1.0, 5.2)))
                writer.transport.abort()
            await asyncio.sleep(0.3)


class Watcher:
    """A client at a good network, who stops the car now and then; and who may lift a stop."""

    def __init__(self, run: Any) -> None:
        self.run = run
        self.process = Process(run.world, "watcher", 0.001)
        self.random = Random(f"{run.world.seed} watcher")
        self._clears = self._clearing = 0

    def start(self) -> None:
        SimulatedLoop(self.process, self.run.network).run(self._watch)

    async def _watch(self) -> None:
        run = self.run
        await asyncio.sleep(self.random.uniform(0.5, 4))
        client = DriveClient("car", _COMMANDS)
        client.begin()
        await asyncio.sleep(self.random.uniform(0.2, 2))
        for _ in range(self.random.randint(0, 2)):
            begin_s, car, is_calm = run.world.now_s, run.car, client.connected
            with suppress(DriveError):
                await self.stop_with(client)
            if is_calm and not run.pins.was_disturbed(begin_s) and car is run.car and not car.is_dead:
                took_s = run.world.now_s - begin_s
                run.world.keep("stop-gets-through", took_s < 0.2 and client.connected, f"after {took_s:.3f} s")
            await asyncio.sleep(self.random.uniform(0.1, 1.0))
            with suppress(DriveError):
                await self.clear_with(client)
        await self._stop_as_newcomer()
        await asyncio.sleep(60)

    async def stop_with(self, client: DriveClient) -> None:
        """Stop the car; where it has answered nothing moves until somebody begins to lift the stop."""
        clears, car = self._clears_before(), self.run.car
        await client.stop()
        self._halt(clears, car)

    def _clears_before(self) -> int:
        """How often somebody began to lift a stop; -1 where that goes on: the car may get it after a new stop."""
        return -1 if self._clearing else self._clears

    def _halt(self, clears: int, car: Process) -> None:
        """A stop was answered: it holds, unless somebody began to lift it meanwhile, or the server started again."""
        if self._clears == clears and not self._clearing and car is self.run.car and not car.is_dead:
            self.run.world.note("halted")
            self.run.pins.is_halted = True

    async def clear_with(self, client: DriveClient) -> None:
        """Lift a stop."""
        self._clears += 1
        self._clearing += 1
        self.run.pins.is_halted = False
        try:
            await client.clear()
        except DriveError:
            # A request without an answer may be on its way for long.
            self.run.world.after(12.0, self._end_clearing)
            raise
        self._end_clearing()

    def _end_clearing(self) -> None:
        self._clearing -= 1

    async def _stop_as_newcomer(self) -> None:
        """Stop by a new connection, which needs no place, while strangers take all places."""
        run = self.run
        clears, car, is_calm = self._clears_before(), run.car, not run.car.is_dead
        begin_s = run.world.now_s
        with suppress(OSError, asyncio.IncompleteReadError, TimeoutError):
            async with asyncio.timeout(2.0):
                reader, writer = await asyncio.open_connection("car", _TELEMETRY)
                text = json.dumps({"do": "stop"}).encode()
                writer.write(struct.pack(">I", len(text)) + text)
                answer: dict[str, Any] = {}
                while answer.get("do") != "stop":
                    (size,) = struct.unpack(">I", await reader.readexactly(4))
                    answer = json.loads(await reader.readexactly(size))
                writer.close()
                self._halt(clears, car)
                run.world.keep("stop-gets-through", bool(answer.get("ok")), answer)
        if is_calm and not run.pins.was_disturbed(begin_s) and car is run.car and not car.is_dead:
            took_s = run.world.now_s - begin_s
            run.world.keep("stop-gets-through", took_s < 1.0, f"a newcomer's after {took_s:.3f} s")
        await asyncio.sleep(0.2)
        if not run.world.is_healed:
            with suppress(DriveError):
                async with DriveClient("car", _COMMANDS) as client:
                    await self.clear_with(client)


class Stranger:
    """Somebody who opens connections, says nothing or nonsense, asks without reading, or takes places.

    One of a crowd ``holds`` two places: together with the drivers they take all nine.
    """

    def __init__(self, run: Any, number: int, holds: bool = False) -> None:
        self.run = run
        self._holds = holds
        self.process = Process(run.world, f"stranger {number}", 0.001)
        self.random = Random(f"{run.world.seed} stranger {number}")

    def start(self) -> None:
        SimulatedLoop(self.process, self.run.network).run(self._hold if self._holds else self._bother)

    async def _hold(self) -> None:
        self.run.world.count("stranger")
        writers: list[asyncio.StreamWriter] = []
        while True:
            with suppress(OSError):
                writers = [each for each in writers if not each.is_closing()]
                while len(writers) < 2:
                    writers.append((await asyncio.open_connection("car", _COMMANDS))[1])
                for writer in writers:
                    writer.write(_STILL)
            await asyncio.sleep(0.3)

    async def _bother(self) -> None:
        self.run.world.count("stranger")
        await asyncio.sleep(self.random.uniform(0.2, 2.0))
        writers = []
        reads = self.random.random() < 0.5
        count = self.random.choice((3, 12, 100))
        for _ in range(count):
            with suppress(OSError):
                _, writer = await asyncio.open_connection("car", self.random.choice((_COMMANDS, _TELEMETRY)))
                writers.append(writer)
                if not reads:
                    writer.transport.pause_reading()
                writer.write(self._bytes() * self.random.choice((1, 1, 1, 300)))
            await asyncio.sleep(self.random.uniform(0.0, 0.6 / count))
        while True:
            await asyncio.sleep(0.3)
            for writer in writers:
                if not writer.is_closing() and self.random.random() < 0.3:
                    writer.write(self._bytes())

    def _bytes(self) -> bytes:
        random = self.random
        text = random.choice(
            (b'{"do":"request"}', b'{"do":"join"}', b'{"do":"release"}', b"[1]", b"{", b'{"do":"sync"}')
        )
        # With its length before it, it is no command either: a length of 16 begins one that moves the car.
        text = text.ljust(48)
        return random.choice(
            (
                b"",
                # No command, wherever the car begins to read.
                bytes(each for each in random.randbytes(random.randint(1, 60)) if each >> 4 not in (1, 2)),
                # A command with speed 0, which takes a place.
                _STILL,
                struct.pack(">I", len(text)) + text,
                struct.pack(">I", 1 << 30),
            )
        )
