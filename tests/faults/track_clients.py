"""Motorcade's own client at a car in a quiet room: what it sends, how long, and what it tells."""

import asyncio
import struct
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from tests.faults.loop import SimulatedLoop
from tests.faults.network import Link, Socket
from tests.faults.track_car import COMMANDS, FAILSAFE_S, TELEMETRY, Track
from tests.faults.world import Process

from motorcade.drive.client import DriveClient
from motorcade.drive.wire import Telemetry, pack_frame
from motorcade.errors import DriveError

_PERIOD_S, _ARMS_S, _SILENT_S = 0.05, 0.6, 0.5
_SPEED = 255 << 11


class Heard:
    """What a client sends at the port for commands: when, and at which speed."""

    def __init__(self, run: Track) -> None:
        self.words: list[tuple[float, int, int]] = []
        self.begun_s: list[float] = []
        self.clocks_s: list[float] = []

        def watch(name: str, port: int, socket: Socket) -> None:
            if port == TELEMETRY:
                socket.tap = lambda data: self.clocks_s.extend([run.world.now_s] * data.count(b'"sync"'))
            if port == COMMANDS:
                self.begun_s.append(run.world.now_s)
                socket.tap = lambda data: self.words.extend(
                    (run.world.now_s, word >> 28, (word & _SPEED) >> 11) for (word,) in struct.iter_unpack(">I", data)
                )

        run.network.watch = watch

    def moves_since(self, since_s: float) -> list[float]:
        """When it has sent commands that move the wheels since a time."""
        return [at_s for at_s, code, speed in self.words if at_s > since_s and code == 1 and speed]

    def moves_early(self) -> list[float]:
        """When it has sent commands that move the wheels by a connection at which it has answered no clock yet."""
        ends_s = [*self.begun_s[1:], float("inf")]
        early = []
        for begin_s, end_s in zip(self.begun_s, ends_s, strict=True):
            answered_s = min([at_s for at_s in self.clocks_s if at_s > begin_s], default=end_s)
            early += [at_s for at_s in self.moves_since(begin_s) if at_s < min(answered_s, end_s)]
        return early


async def renew(run: Track) -> None:
    """A client repeats a command for as long as that counts, and no longer; a car is armed before it moves."""
    async with run.car() as board:
        heard, rearm = Heard(run), run.random.random() < 0.5
        client = DriveClient("car", COMMANDS, rearm=rearm)
        client.begin()
        if not rearm:
            # A person releases the stick after the connection has begun.
            await _hold(run, client, 0.0, 0.3)
        await _hold(run, client, 0.5, 1.5)
        run.keep("drives-again", board.setpoint == (72, 1, 128), f"a client drives by {board.setpoint}")
        await _hold(run, client, -0.25, 0.2)
        run.keep("sent", board.setpoint == (72, 0, 64), f"a client that drives back drives by {board.setpoint}")
        # Answers that come one after the other are each for its request.
        has_wheel, _ = await asyncio.gather(client.request(), client.clear())
        run.keep("as-asked", has_wheel, "the driver is told that another one has the wheel")
        await _hold(run, client, 0.5, 0.2)
        first = next(at_s for at_s, code, speed in heard.words if speed and code == 1)
        still = [at_s for at_s, _, speed in heard.words if not speed and at_s < first - 0.04]
        run.keep("armed", bool(still), "a client sends a speed before speed 0")
        renewed_s = run.world.now_s
        await asyncio.sleep(1.5)
        last_s = max(heard.moves_since(0.0))
        is_so = FAILSAFE_S - 2 * _PERIOD_S < last_s - renewed_s + _PERIOD_S < FAILSAFE_S + 2 * _PERIOD_S
        run.keep("held-stick", is_so, f"a command is repeated for {last_s - renewed_s:.2f} s")
        run.keep("stands-in-time", board.speed == 0, "a client that is commanded nothing drives")
        telemetry = await client.next_telemetry()
        run.keep("shows-what-is", telemetry.driver == client.you["name"], f"{telemetry.driver}")
        await _stop(run, client, heard, rearm)
        await client.end()


async def _hold(run: Track, client: DriveClient, throttle: float, seconds: float) -> None:
    end_s = run.world.now_s + seconds
    while run.world.now_s < end_s:
        with suppress(DriveError):
            client.steer(throttle, 0.2)
        await asyncio.sleep(_PERIOD_S)


async def _stop(run: Track, client: DriveClient, heard: Heard, rearm: bool) -> None:
    """Behind a stop a stick that a person still holds moves nothing, also when that is lifted, until it is released."""
    holding = asyncio.create_task(_hold(run, client, 0.5, 1.5))
    await asyncio.sleep(0.5)
    await client.stop()
    stopped_s = run.world.now_s
    run.keep("stop-gets-through", run.board.speed == 0, "the wheels turn after a client's stop")
    await asyncio.sleep(0.3)
    run.keep("stop-holds", run.board.speed == 0, "a client drives on after its stop")
    await client.clear()
    await holding
    if not rearm:
        run.keep("held-stick", not heard.moves_since(stopped_s), "a stick that is held behind a stop moves the car")
        client.steer(0.0, 0.0)
        await asyncio.sleep(0.1)
    await _hold(run, client, 0.5, 1.0)
    run.keep("drives-again", run.board.speed > 0, "nobody can drive behind a stop")


async def hear_nothing(run: Track) -> None:
    """A client that hears nothing sends nothing: it would come too late. It connects again, and a stick is released."""
    async with run.car() as board:
        heard, link = Heard(run), run.network.links["people"]
        rearm = run.random.random() < 0.5
        client = DriveClient("car", COMMANDS, rearm=rearm)
        client.begin()
        await _hold(run, client, 0.0, 0.3)
        await _hold(run, client, 0.5, 1.2)
        link.stall(1.2)
        silent_s = run.world.now_s
        await _hold(run, client, 0.5, 1.1)
        late = [at_s - silent_s for at_s in heard.moves_since(silent_s + _SILENT_S + 3 * _PERIOD_S)]
        run.keep("no-old-command", not late, f"commands are sent {late} s after the last telemetry")
        run.keep("stands-in-time", board.speed == 0, "the wheels turn while nothing comes")
        await _hold(run, client, 0.5, 1.0)
        if not rearm:
            run.keep("held-stick", board.speed == 0, "a stick that was held while nothing came moves the car")
            run.keep("held-stick", client.waits_for_release, "nobody is told that the stick has to be released")
            client.steer(0.0, 0.0)
            await asyncio.sleep(0.1)
        await _hold(run, client, 0.5, 1.0)
        run.keep("drives-again", board.speed > 0, "nobody can drive after a stall")
        for lose, seen_s, within_s in run.random.sample(_losses(run, link), 2):
            lose()
            seen_s += run.world.now_s
            await _hold(run, client, 0.5, within_s)
            if not rearm:
                run.keep("held-stick", not heard.moves_since(seen_s), "a stick that was held while a connection broke")
                await _hold(run, client, 0.0, 0.2)
                await _hold(run, client, 0.5, 1.5)
            run.keep("drives-again", board.speed > 0, "a client doesn't connect again")
        early_s = heard.moves_early()
        run.keep("no-old-command", not early_s, f"a client moves the wheels before it answers a clock: {early_s}")
        await client.end()


def _losses(run: Track, link: Link) -> list[tuple[Callable[[], object], float, float]]:
    """In which ways the connections to a car end, when a client knows that, and when its driver can drive again.

    A driver who hears nothing for two seconds connects anew, and waits for at most three until that is done.
    """
    car = next(process for process in reversed(run.world.processes) if process.name == "car")
    silent_s = _SILENT_S + 3 * _PERIOD_S
    return [
        (link.cut, 0.0, 2.5),
        (link.forget_one_end, 0.0, 2.5),
        (lambda: link.forget_one_end(first=False), silent_s, 5.0),
        (lambda: link.stall(4.0), silent_s, 9.0),
        (lambda: car.freeze(3.0), silent_s, 8.0),
    ]


class _Flooding(asyncio.Protocol):
    """A drive server that floods, at one of its ports."""

    def __init__(self, kind: str, port: int, counts: Counter[int]) -> None:
        self._kind, self._port, self._counts = kind, port, counts

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport: Any = transport
        self._counts[self._port] += 1
        if self._port == TELEMETRY:
            self._send(_FRAME)
        self._flood()

    def _send(self, data: bytes) -> None:
        self._transport.write(data)

    def _flood(self) -> None:
        if self._transport.is_closing():
            return
        if self._port == COMMANDS and self._kind == "commands":
            self._send(b"x" * 8000)
        elif self._port == TELEMETRY:
            floods = {"frames": 30 * _FRAME, "long": struct.pack(">I", 1 << 30), "text": _framed(b"[1]")}
            self._send(floods.get(self._kind, _FRAME))
        asyncio.get_running_loop().call_later(0.1, self._flood)


def _framed(text: bytes) -> bytes:
    return struct.pack(">I", len(text)) + text


_AT_REST = Telemetry("ready", 0, 0, 0, None, None, None, None, 0, 0, 0, 0, 0, "", 0, {})
_FRAME = pack_frame({"kind": "telemetry", "you": {}} | _AT_REST._asdict())


async def flood(run: Track) -> None:
    """A drive server that sends too much, or nonsense, is hung up; one that doesn't stays connected."""
    kind = run.random.choice(("frames", "commands", "long", "text", "calm"))
    process, counts = Process(run.world, "car", 0.001), Counter[int]()
    loop = SimulatedLoop(process, run.network)

    async def serve(port: int) -> None:
        listening: Any = run.network.listen(process, "car", port)
        while True:
            line, _ = await loop.sock_accept(listening)
            await loop.connect_accepted_socket(lambda: _Flooding(kind, port, counts), line)

    async def serve_both() -> None:
        await asyncio.gather(serve(COMMANDS), serve(TELEMETRY))

    loop.run(serve_both)
    await asyncio.sleep(0.2)
    client = DriveClient("car", COMMANDS)
    client.begin()
    await asyncio.sleep(6.0)
    is_kept = counts[TELEMETRY] == 1
    run.keep("floods", is_kept == (kind == "calm"), f"a drive server of {kind} is called {counts[TELEMETRY]} times")
    await client.end()
    process.end()


ACTS = (renew, hear_nothing, flood)
