"""Driving by TLS in the simulated room: who has keys that count drives, and nobody else.

One act follows another. Drivers with keys, without, with those of another authority, of a car, or revoked ones try to
drive and to stop; some begin handshakes and never end them. The list is replaced, damaged, cut and removed, while the
car runs and while it is off.
"""

import asyncio
import json
import ssl
import struct
import tempfile
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from random import Random
from types import SimpleNamespace
from typing import Any, NamedTuple

from tests.faults.disk import Disk
from tests.faults.loop import SimulatedLoop
from tests.faults.network import Network
from tests.faults.system import THREADS, Replaced, in_threads, on_disk, replaced
from tests.faults.world import Process, World

from motorcade.car.drive_board import DriveBoard
from motorcade.config.profile import built_in_profile
from motorcade.drive import activity_log as drive_log
from motorcade.drive import client as drive_client
from motorcade.drive import server as drive_server
from motorcade.drive import session as drive_session
from motorcade.drive.certificates import CarKeys, list_keys, make_keys
from motorcade.drive.channels import Clients
from motorcade.drive.client import DriveClient
from motorcade.drive.keys import RevokedKeys, client_context, server_context, write_revoked
from motorcade.drive.server import serving, watched
from motorcade.drive.session import CarControl
from motorcade.errors import DriveError
from motorcade.timing import to_ticks
from motorcade.words.formats import DRIVE

PROFILE = built_in_profile("classroom")
_COMMANDS, _TELEMETRY = 5005, 5006
_ACTS = 9
# Revoked keys are refused within a second; the list is looked at twice in it.
_REVOKED_S, _STOP_S = 1.2, 2.0
_DRIVERS = ("lin", "mei", "bea")
_ARM = struct.pack(">I", DRIVE.encode(angle=90, direction=1, speed=0))
_MOVE = struct.pack(">I", DRIVE.encode(angle=90, direction=1, speed=99))
_HELLO = b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(range(60))


class Keys(NamedTuple):
    """TLS contexts of all who try, and the serial numbers of the drivers' keys."""

    car: ssl.SSLContext
    clients: dict[str, ssl.SSLContext | None]
    numbers: dict[str, int]


@cache
def keys() -> Keys:
    """Make the keys, once for all runs: they take no part in what happens."""
    with tempfile.TemporaryDirectory() as name:
        own, other = Path(name) / "own", Path(name) / "other"
        now = datetime.now(UTC)
        for folder in (own, other):
            folder.mkdir()
            make_keys(folder, [CarKeys("ada")], _DRIVERS, now)
        drivers = {driver: client_context(own / f"driver-{driver}.pem") for driver in _DRIVERS}
        mute = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        mute.check_hostname = False
        mute.verify_mode = ssl.CERT_NONE
        of_a_car = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        of_a_car.check_hostname = False
        of_a_car.verify_mode = ssl.CERT_NONE
        of_a_car.load_cert_chain(own / "car-ada.pem")
        old = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        old.check_hostname = False
        old.verify_mode = ssl.CERT_NONE
        old.load_cert_chain(own / "driver-lin.pem")
        old.maximum_version = ssl.TLSVersion.TLSv1_2
        elsewhere = client_context(other / "driver-lin.pem")
        elsewhere.check_hostname = False
        elsewhere.verify_mode = ssl.CERT_NONE
        numbers = {each.name: each.number for each in list_keys(own) if each.role == "driver"}
        strangers = {"plain": None, "no-keys": mute, "of-a-car": of_a_car, "old-tls": old, "elsewhere": elsewhere}
        return Keys(server_context(own / "car-ada.pem"), drivers | strangers, numbers)


class CountingBoard(DriveBoard):
    """Hardware that notes what it is told."""

    switches = ("horn",)

    def __init__(self) -> None:
        self.moves = self.stops = 0
        self.speed = 0

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        self.moves += speed > 0
        self.speed = speed

    def neutral(self) -> None:
        self.stops += 1
        self.speed = 0


class KeyedCar:
    """One run."""

    def __init__(self, room: World) -> None:
        self.world = room
        self.random = Random(f"{room.seed} plan")
        self.disk = Disk(room, self.random)
        self.file = self.disk.path("/keys/revoked.txt")
        self.disk.create(self.disk.path("/keys"), True)
        self.network = Network(room)
        self.people = Process(room, "people", 0.001)
        self.network.link("people", 0.01)
        self.slow = self.network.link("10.0.9.9", 0.08)
        self.car: Process | None = None
        self.board = CountingBoard()
        self.control: CarControl | None = None
        self.revoked: set[str] = set()
        # Whether the list is as it was written.
        self.is_whole = True
        self.drivers: dict[str, DriveClient] = {}
        self._addresses = 0
        self.records: list[tuple[str, str]] = []

    # The car.

    def start(self) -> None:
        """Start the car's server."""
        process = self.car = Process(self.world, "car", 0.001)
        loop = SimulatedLoop(process, self.network)
        self.board = board = CountingBoard()

        async def serve() -> None:
            control = self.control = CarControl(board, lambda: to_ticks(loop.time()), PROFILE)
            control.record = lambda did, who: self.records.append((did, who))
            sockets: list[Any] = [self.network.listen(process, "car", port) for port in (_COMMANDS, _TELEMETRY)]
            clients = Clients(control, revoked=RevokedKeys(self.file, is_expected=False))
            async with watched(control), serving(clients, *sockets, tls=keys().car):
                await asyncio.Event().wait()

        loop.run(serve)

    def write(self, who: set[str]) -> None:
        """Revoke these, by a list that is replaced whole."""
        self.revoked = set(who)
        write_revoked(self.file, {keys().numbers[driver]: driver for driver in sorted(who)})
        self.disk.settle()
        self.is_whole = True

    # Acts.

    async def live(self) -> None:
        """Do one act after the other."""
        if self.random.random() < 0.5:
            self.write({"bea"})
        self.start()
        await asyncio.sleep(0.5)
        acts: list[tuple[float, Callable[[], Any]]] = [
            (2.0, self.drive),
            (2.5, self.strangers),
            (2.0, self.revoke),
            (1.0, self.hold_commands),
            (1.5, self.rot),
            (1.5, self.restart),
            (0.25, self.flood),
            (1.0, self.stop),
        ]
        weights, some = zip(*acts, strict=True)
        for _ in range(_ACTS):
            act = self.random.choices(some, weights)[0]
            self.world.note("act", act.__name__)
            await act()
        for client in self.drivers.values():
            await client.end()
        self.world.is_over = True

    def client(self, name: str) -> DriveClient:
        """A driver with the keys of that name."""
        return DriveClient("car", _COMMANDS, keys=keys().clients[name], car="ada", patience_s=3.0)

    async def reached(self, name: str, within_s: float = 3.0) -> bool:
        """Whether somebody with these keys gets telemetry of the car."""
        client = self.drivers.get(name)
        if client is None:
            client = self.drivers[name] = self.client(name)
            client.begin()
        end_s = self.world.now_s + within_s
        while self.world.now_s < end_s:
            if client.connected and client.telemetry:
                return True
            await asyncio.sleep(0.05)
        return False

    async def drive(self) -> None:
        """Who has keys that count drives."""
        name = self.random.choice([driver for driver in _DRIVERS if driver not in self.revoked] or ["lin"])
        if name in self.revoked:
            return
        if not self.is_whole:
            return
        self.world.keep("drives-again", await self.reached(name, 8.0), f"{name}, whose keys count, isn't let in")
        client, before = self.drivers[name], self.board.moves
        with suppress(DriveError):
            await client.request()
        for _ in range(120):
            client.steer(0.4, 0.0, horn=1)
            await asyncio.sleep(0.05)
            if self.board.moves > before:
                break
        moved = self.board.moves > before
        self.world.keep("drives-again", moved, f"{name}, whose keys count, can't drive")
        driver = self.control.telemetry().driver if self.control else ""
        self.world.keep("logged", str(driver).startswith(name), f"{driver!r} drives with the keys of {name}")
        self.world.keep("logged", any(who.startswith(name) for _, who in self.records), f"{self.records[-3:]}")
        client.steer(0.0, 0.0)
        await asyncio.sleep(0.3)
        with suppress(DriveError):
            await client.release()
        self.world.keep("stands-in-time", self.board.speed == 0, "the wheels turn after the stick was released")

    async def stop(self) -> None:
        """Whoever has keys stops the car."""
        name = self.random.choice([driver for driver in _DRIVERS if driver not in self.revoked] or ["lin"])
        if name in self.revoked or not self.is_whole or not await self.reached(name, 8.0):
            return
        begin_s = self.world.now_s
        with suppress(DriveError):
            await self.drivers[name].stop()
        assert self.control
        is_stopped = self.control.telemetry().state == "stopped"
        self.world.keep("stop-gets-through", is_stopped, f"{name} can't stop the car")
        took_s = self.world.now_s - begin_s
        self.world.keep("stop-gets-through", took_s < 0.5, f"after {took_s:.2f} s")
        with suppress(DriveError):
            await self.drivers[name].clear()

    async def strangers(self) -> None:
        """Who has no keys that count moves nothing, sees nothing and stops nothing."""
        names = ["plain", "no-keys", "of-a-car", "old-tls", "elsewhere", *sorted(self.revoked)]
        for name in self.random.sample(names, 2):
            moves, stops = self.board.moves, self.control and self.control.telemetry().state
            assert self.control
            before = self.control.turned_away
            told = await self._try(name)
            self.world.keep("strangers-stay-out", not told, f"{name} is sent {told[:60]!r}")
            counted = self.control.turned_away - before
            self.world.keep("logged", counted > 0, f"{name} isn't counted among those who were turned away")
            self.world.keep("strangers-stay-out", self.board.moves == moves, f"{name} moves the car")
            state = self.control and self.control.telemetry().state
            both = {stops, state}
            self.world.keep("strangers-stay-out", "stopped" not in both or len(both) == 1, f"{name} stops the car")

    async def _try(self, name: str) -> bytes:
        """Try to drive and to stop with these keys; return what the car's telemetry has told."""
        told = b""
        for port, data in ((_COMMANDS, _ARM + _MOVE), (_TELEMETRY, _framed({"do": "stop"}))):
            with suppress(OSError, EOFError, asyncio.IncompleteReadError, TimeoutError):
                async with asyncio.timeout(4.0):
                    reader, writer = await self._open(port, keys().clients[name])
                    writer.write(data)
                    came = await reader.read(1000)
                    # An alert of TLS is no telemetry.
                    told += came if keys().clients[name] or came[:1] != b"\x15" else b""
                    writer.transport.abort()
        await asyncio.sleep(0.3)
        return told

    async def _open(self, port: int, tls: ssl.SSLContext | None, address: str = "") -> Any:
        self._addresses += 1
        at = (address or f"10.0.2.{self._addresses % 250}", 0)
        more: dict[str, Any] = {"ssl": tls, "server_hostname": "ada"} if tls else {}
        return await asyncio.open_connection("car", port, local_addr=at, **more)

    # The list.

    async def revoke(self) -> None:
        """Some keys are revoked: who is connected by them is out within a second; nobody else notices."""
        stay = [name for name, client in self.drivers.items() if client.connected and client.telemetry]
        more = self.random.choice([{"lin"}, {"mei"}, {"bea"}, {"lin", "bea"}, set()])
        drives = self.random.choice(stay) if stay and self.is_whole else None
        connections = {name: self.drivers[name]._connection for name in stay}
        revoked = self.revoked | more
        others = sorted(set(_DRIVERS) - self.revoked)
        if self.revoked and others and self.random.random() < 0.4:
            # In place of one who may drive again, so the list is as long as before.
            back = self.random.choice(sorted(self.revoked))
            revoked = self.revoked - {back} | {self.random.choice(others)}
        self.write(revoked)
        end_s = self.world.now_s + _REVOKED_S
        while self.world.now_s < end_s:
            if drives:
                self.drivers[drives].steer(0.3, 0.0)
            await asyncio.sleep(0.05)
        for name in sorted(self.revoked):
            client = self.drivers.pop(name, None)
            if client:
                self.world.keep(
                    "revoked-are-out", not client.telemetry, f"{name}, whose keys are revoked, is connected"
                )
                await client.end()
        if drives in self.revoked:
            await asyncio.sleep(0.1)
            self.world.keep("revoked-are-out", self.board.speed == 0, "the wheels turn for a revoked driver")
        for name in sorted(set(stay) - self.revoked):
            is_same = self.drivers[name]._connection is connections[name]
            self.world.keep("revoked-are-out", is_same, f"{name}'s connection breaks though the keys count")
        if drives and drives not in self.revoked:
            self.drivers[drives].steer(0.0, 0.0)
        await asyncio.sleep(0.4)

    async def hold_commands(self) -> None:
        """A client of somebody's own keeps the connection for commands alone: once its keys are revoked it is out."""
        if not self.is_whole or set(_DRIVERS) <= self.revoked:
            return
        for client in self.drivers.values():
            await client.end()
        self.drivers.clear()
        name = self.random.choice([driver for driver in _DRIVERS if driver not in self.revoked])
        reader, writer = await self._open(_COMMANDS, keys().clients[name])
        writer.write(_ARM + _ARM)
        begin_s, before = self.world.now_s, self.board.moves
        # For so long nobody takes its keys away.
        while self.world.now_s < begin_s + 1.0 + _REVOKED_S and not writer.is_closing():
            if self.world.now_s >= begin_s + 1.0 and name not in self.revoked:
                moved = self.board.moves > before
                self.world.keep("drives-again", moved, f"{name}, whose keys count, can't drive by commands alone")
                self.write(self.revoked | {name})
            writer.write(_MOVE)
            await asyncio.sleep(0.05)
        await asyncio.sleep(0.1)
        self.world.keep("revoked-are-out", self.board.speed == 0, f"{name}, whose keys are revoked, moves the car")
        with suppress(OSError):
            async with asyncio.timeout(0.5):
                await reader.read(1)
        self.world.keep("revoked-are-out", reader.at_eof() or writer.is_closing(), f"{name} stays connected")
        writer.transport.abort()

    async def rot(self) -> None:
        """The list is damaged while the car runs: what it had stays valid, and the car says so."""
        if not self.disk.path("/keys/revoked.txt").exists() or not self.is_whole:
            return
        stays = next((name for name in _DRIVERS if name not in self.revoked), None)
        connection = None
        if stays and await self.reached(stays, 8.0):
            connection = self.drivers[stays]._connection
        self._damage()
        await asyncio.sleep(_REVOKED_S)
        if stays and connection:
            is_same = self.drivers[stays]._connection is connection
            self.world.keep("revoked-are-out", is_same, f"a damaged list hangs {stays} up, whose keys count")
        for name in sorted(self.revoked)[:2]:
            told = await self._try(name)
            self.world.keep("fails-closed", not told, f"{name} is let in by a damaged list")
        await self._mend()

    def _damage(self) -> None:
        """Cut, flip, empty or fill the list; or remove it."""
        node, random = self.disk.find(self.file), self.random
        good = node.data
        cut = good[: random.randrange(len(good))]
        at = random.randrange(len(good))
        flipped = good[:at] + bytes([good[at] ^ 1 << random.randrange(8)]) + good[at + 1 :]
        bad = random.choice((cut, cut, flipped, b"", b"\0" * len(good), b"\xff\xfe", good.replace(b"\n", b"")))
        self._good, self.is_whole = good, bad == good
        node.data = node.kept = bad
        node.changed_s = self.world.now_s

    async def _mend(self) -> None:
        node = self.disk.find(self.file)
        node.data = node.kept = self._good
        node.changed_s = self.world.now_s
        self.is_whole = True
        await asyncio.sleep(_REVOKED_S)

    async def restart(self) -> None:
        """The car starts again, perhaps with a damaged list: then nobody who is revoked gets in."""
        assert self.car
        is_there = self.disk.path("/keys/revoked.txt").exists() and self.is_whole
        damages = is_there and bool(self.revoked) and self.random.random() < 0.6
        self.car.end()
        if damages:
            self._damage()
        self.start()
        await asyncio.sleep(0.5)
        if damages:
            for name in sorted(self.revoked):
                told = await self._try(name)
                self.world.keep("fails-closed", not told, "{} is let in by a list that is {!r}", name, self._data())
            await self._mend()

    def _data(self) -> bytes:
        return self.disk.find(self.file).data

    # Floods.

    async def flood(self) -> None:
        """Many begin handshakes and never end them, or leave: whoever has keys stops the car all the same."""
        name = next((driver for driver in _DRIVERS if driver not in self.revoked), None)
        if name is None or not self.is_whole:
            return
        self.world.count("stranger")
        writers: list[asyncio.StreamWriter] = []
        ended = asyncio.Event()
        hosts = self.random.choice((1, 6, 12))

        async def begin(host: int) -> None:
            while not ended.is_set():
                with suppress(OSError):
                    _, writer = await self._open(_TELEMETRY, None, f"10.6.0.{host}")
                    writer.write(self.random.choice((_HELLO, b"", b"GET / HTTP/1.1\r\n\r\n")))
                    if self.random.random() < 0.3:
                        writer.close()
                    writers.append(writer)
                await asyncio.sleep(0.004)

        tasks = [asyncio.create_task(begin(host)) for host in range(hosts)]
        await asyncio.sleep(0.4)
        begin_s, is_stopped = self.world.now_s, False
        while not is_stopped and self.world.now_s < begin_s + _STOP_S:
            is_stopped = await self._stop_as_newcomer(name)
        took_s = self.world.now_s - begin_s
        ended.set()
        for task in tasks:
            task.cancel()
        for writer in writers:
            writer.transport.abort()
        self.world.keep("stop-gets-through", is_stopped and took_s < _STOP_S, f"a newcomer's after {took_s:.1f} s")
        await asyncio.sleep(2.5)
        if await self.reached(name, 8.0):
            with suppress(DriveError):
                await self.drivers[name].clear()

    async def _stop_as_newcomer(self, name: str) -> bool:
        with suppress(OSError, EOFError, asyncio.IncompleteReadError, TimeoutError):
            async with asyncio.timeout(3.0):
                reader, writer = await self._open(_TELEMETRY, keys().clients[name], "10.0.9.9")
                writer.write(_framed({"do": "stop"}))
                while True:
                    (size,) = struct.unpack(">I", await reader.readexactly(4))
                    answer = json.loads(await reader.readexactly(size))
                    if answer.get("do") == "stop":
                        writer.transport.abort()
                        return bool(answer.get("ok"))
        await asyncio.sleep(0.05)
        return False

    def names(self) -> Replaced:
        return (
            on_disk(self.disk)
            | in_threads()
            | {
                (drive_session, "threading"): THREADS,
                (drive_server, "threading"): THREADS,
                (drive_log, "threading"): THREADS,
                (drive_client, "random"): SimpleNamespace(uniform=self.random.uniform),
            }
        )


def _framed(message: dict[str, Any]) -> bytes:
    text = json.dumps(message).encode()
    return struct.pack(">I", len(text)) + text


def run_keys(room: World) -> None:
    """Run the scenario; raises the first promise that is broken."""
    keys()
    run = KeyedCar(room)
    with replaced(run.names()):
        SimulatedLoop(run.people, run.network).run(run.live)
        room.run(400.0)
        room.keep("goes-on", room.is_over, "the last act never ended")
