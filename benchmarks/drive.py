"""Measure how fast a car gets commands, and how soon it stops without them. Run ``python benchmarks/drive.py``.

A round trip begins when a client sends four bytes to another process, and ends when the byte comes back that the car's
board sent for the command. An asyncio echo that ignores its input makes the same round trip; both take turns on one
processor, and figures are medians of turns. The time of a failsafe runs from the last command that reached the board to
the command that stops the wheels; the board's process records both. ``--soak 300`` measures growth in 300 s instead.
"""

import argparse
import asyncio
import os
import signal
import socket
import struct
import sys
import tempfile
import time
from collections.abc import Awaitable, Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from statistics import median, quantiles

import psutil
from drive_cars import Note, ServerProcess, connect, server_process
from drive_ends import HANG, ends_ms
from rich.console import Console
from rich.table import Table
from swarm import result

from motorcade.drive.certificates import CarKeys, make_keys
from motorcade.drive.client import DriveClient
from motorcade.drive.keys import client_context
from motorcade.words.formats import DRIVE

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))
from support.fault_proxy import FaultProxy

TURNS, TRIPS = 31, 1000
MEDIAN_GOAL, TAIL_GOAL, RATE_GOAL = 1.2, 2.0, 10_000
CUTS, AT_ONCE = 1000, 20
FAILSAFE_MS, FAILSAFE_GOAL_MS = 300, 330
CARS, RATE_HZ, LATE_GOAL_MS = 100, 20, 50
# Each command has an angle of its own, by which the board's notes are matched. Neutral has 90.
ANGLES = [angle for angle in range(181) if angle != 90]
SOAK_WARM_S, SETTLE_S, SOAK_GOAL = 30, 2, 1.02
PERIOD_S = 0.04

Rows = Iterator[tuple[str, str, str, str]]


def word(angle: int, speed: int) -> bytes:
    return struct.pack(">I", DRIVE.encode(angle=angle, direction=1, speed=speed))


STILL = word(90, 0)


# Round trips


def trips_us(connection: socket.socket, count: int) -> list[float]:
    """Return the duration of each of ``count`` round trips."""
    words = [word(angle, 150) for angle in range(181)]
    times = []
    for number in range(count):
        begin = time.perf_counter_ns()
        connection.send(words[number % 181])
        connection.recv(1)
        times.append((time.perf_counter_ns() - begin) / 1000)
    return times


@contextmanager
def one_processor() -> Iterator[None]:
    """Run this process, and those that the block starts, on one processor, where the system can do that.

    Waking a second processor takes three times as long as a round trip, and the system chooses when it does.
    """
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def trip_rows(keys: Path, turns: int) -> Rows:
    for name, car_keys, tls in (
        ("plain", None, None),
        ("mutual TLS", keys / "car-ada.pem", client_context(keys / "driver-lin.pem")),
    ):
        with ExitStack() as stack:
            stack.enter_context(one_processor())
            kinds = ("echo", "answering")
            connections = {}
            for kind in kinds:
                server = stack.enter_context(server_process(kind, car_keys))
                connections[kind] = stack.enter_context(connect(server.ports[0], tls))
                trips_us(connections[kind], TRIPS)
            times: dict[str, list[list[float]]] = {kind: [] for kind in kinds}
            for _ in range(turns):
                for kind in kinds:
                    times[kind].append(trips_us(connections[kind], TRIPS))
        yield from _trip_rows(name, times, is_goal=not car_keys)


def _trip_rows(name: str, times: dict[str, list[list[float]]], is_goal: bool) -> Rows:
    medians, tails = (
        {kind: [pick(turn) for turn in turns] for kind, turns in times.items()}
        for pick in (median, lambda turn: quantiles(turn, n=100)[98])
    )
    for what, figures, goal in (("p50", medians, MEDIAN_GOAL), ("p99", tails, TAIL_GOAL)):
        car, echo = (median(figures[kind]) for kind in ("answering", "echo"))
        ratio = median(a / b for a, b in zip(figures["answering"], figures["echo"], strict=True))
        shown = f"{car:.0f} µs, echo {echo:.0f} µs: {ratio:.2f}×"
        verdict = result(ratio, goal, least=False) if is_goal else ""
        yield f"{name}: command to board and back, {what}", shown, f"≤ {goal}×" if is_goal else "", verdict
    rate = median(len(turn) / sum(turn) * 1e6 for turn in times["answering"])
    verdict = result(rate, RATE_GOAL) if is_goal else ""
    yield f"{name}: commands a second, one by one", f"{rate:,.0f}", f"≥ {RATE_GOAL:,}" if is_goal else "", verdict


# Failsafe


async def _freeze(proxy: FaultProxy, writer: asyncio.StreamWriter, move: bytes) -> None:
    """Hang, with the connection open."""


async def _send_half(proxy: FaultProxy, writer: asyncio.StreamWriter, move: bytes) -> None:
    """Hang in the middle of a command."""
    writer.write(move[:2])


async def _pull(proxy: FaultProxy, writer: asyncio.StreamWriter, move: bytes) -> None:
    """Pull the cable: the client goes on, and neither end notices."""
    proxy.half_open()
    await _go_on(writer, move)


async def _stall(proxy: FaultProxy, writer: asyncio.StreamWriter, move: bytes) -> None:
    """Stall the network, which delivers the old commands later."""
    proxy.hold(True)
    await _go_on(writer, move)
    proxy.hold(False)


async def _reset_connection(proxy: FaultProxy, writer: asyncio.StreamWriter, move: bytes) -> None:
    """Reset the connection."""
    proxy.cut()


async def _end_connection(proxy: FaultProxy, writer: asyncio.StreamWriter, move: bytes) -> None:
    """Close the connection without a command to stop."""
    proxy.cut(reset=False)


async def _go_on(writer: asyncio.StreamWriter, move: bytes) -> None:
    for _ in range(12):
        writer.write(move)
        await asyncio.sleep(PERIOD_S)


KINDS: dict[str, Callable[[FaultProxy, asyncio.StreamWriter, bytes], Awaitable[None]]] = {
    "client frozen": _freeze,
    "half a command": _send_half,
    "cable pulled": _pull,
    "network stalls": _stall,
    "connection reset": _reset_connection,
    "connection ended": _end_connection,
}
AT_ONCE_KINDS = ("connection reset", "connection ended")
# Each kind steers at an angle of its own, by which the board's notes are matched.
ANGLES_OF = {kind: 10 * number for number, kind in enumerate(KINDS)}


async def cut(port: int, kind: str) -> None:
    """Drive a car, then let the client or the network fail in the way ``kind``."""
    async with FaultProxy(port) as proxy:
        _, writer = await asyncio.open_connection("127.0.0.1", proxy.port)
        move = word(ANGLES_OF[kind], 150)
        for command in (STILL, move, move, move):
            writer.write(command)
            await asyncio.sleep(PERIOD_S)
        await KINDS[kind](proxy, writer, move)
        await asyncio.sleep(0.5)
        writer.transport.abort()
    await asyncio.sleep(PERIOD_S)


async def cut_often(port: int, kinds: list[str]) -> None:
    for kind in kinds:
        await cut(port, kind)


def stops_ms(notes: list[Note]) -> Iterator[tuple[int, float]]:
    """Yield for each drive the angle of its last command, and the time from then until the wheels stand still."""
    last: Note | None = None
    for at_s, setpoint in notes:
        if setpoint[2]:
            last = at_s, setpoint
        elif last:
            yield last[1][0], (at_s - last[0]) * 1000
            last = None


def failsafe_rows(cuts: int) -> Rows:
    names = list(KINDS)
    plans = [[names[(car + number) % len(names)] for number in range(cuts // AT_ONCE)] for car in range(AT_ONCE)]

    async def cut_all(ports: list[int]) -> None:
        await asyncio.gather(*(cut_often(port, plan) for port, plan in zip(ports, plans, strict=True)))

    with server_process("recording", cars=AT_ONCE) as cars:
        asyncio.run(cut_all(cars.ports[::2]))
    found = [stop for notes in cars.notes for stop in stops_ms(notes)]
    fine = idle = again = 0
    for kind, angle in ANGLES_OF.items():
        stops = [stop_ms for stopped_angle, stop_ms in found if stopped_angle == angle]
        planned = sum(plan.count(kind) for plan in plans)
        idle += max(0, planned - len(stops))
        again += max(0, len(stops) - planned)
        soonest = 0 if kind in AT_ONCE_KINDS else FAILSAFE_MS
        fine += sum(soonest <= stop_ms <= FAILSAFE_GOAL_MS for stop_ms in stops)
        shown = f"{min(stops):.0f}–{max(stops):.0f} ms, median {median(stops):.0f} ms"
        yield f"{kind}: wheels stand after, {len(stops)} times", shown, "", ""
    goal = f"{FAILSAFE_MS}–{FAILSAFE_GOAL_MS} ms, or at once"
    yield f"failsafe in time, of {len(found)} drives that were cut", str(fine), goal, result(fine, len(found))
    yield "wheels that moved again", str(again), "0", result(again, 0, least=False)
    # On a busy machine the car's own loop can be stuck: the car stops, and must be armed before it drives again.
    yield "cuts of cars that a stall had stopped before", str(idle), "", ""


def end_rows(count: int) -> Rows:
    for what, name in (("frozen", "SIGSTOP"), ("killed", "SIGKILL"), ("stuck with the interpreter's lock", HANG)):
        if name == HANG or hasattr(signal, name):
            stops = ends_ms(name, count)
            fine = sum(stop <= FAILSAFE_GOAL_MS for stop in stops)
            shown = f"{fine} ({min(stops):.0f}–{max(stops):.0f} ms, median {median(stops):.0f} ms)"
            verdict = result(fine, len(stops))
            yield (
                f"the car's own process is {what}: in time, of {len(stops)}",
                shown,
                f"≤ {FAILSAFE_GOAL_MS} ms",
                verdict,
            )


# Many cars


async def drive_many(ports: list[int]) -> list[list[float]]:
    """Drive all cars at RATE_HZ, evenly out of step; return when each command was sent, in s."""
    sent: list[list[float]] = [[] for _ in ports]

    async def drive_one(number: int, port: int) -> None:
        _, writer = await asyncio.open_connection("127.0.0.1", port)
        loop = asyncio.get_running_loop()
        due_s = loop.time() + number / len(ports) / RATE_HZ
        for angle in ANGLES:
            await asyncio.sleep(max(0.0, due_s - loop.time()))
            sent[number].append(time.perf_counter())
            writer.write(word(angle, 0))
            # A client that is late must not send two commands at once.
            due_s = max(due_s + 1 / RATE_HZ, loop.time() + 0.5 / RATE_HZ)
        await asyncio.sleep(1)
        writer.transport.abort()

    await asyncio.gather(*(drive_one(number, port) for number, port in enumerate(ports)))
    return sent


def many_rows(cars: int) -> Rows:
    servers = [ServerProcess("recording") for _ in range(cars)]
    try:
        ports = [server.ports[0] for server in servers]
        sent = asyncio.run(drive_many(ports))
    finally:
        for server in servers:
            server.end()
    delays_ms, missing = [], 0
    for left, server in zip(sent, servers, strict=True):
        came = {angle: at_s for at_s, (angle, _, _) in server.notes[0]}
        arrived = [(came[angle] - at_s) * 1000 for angle, at_s in zip(ANGLES, left, strict=True) if angle in came]
        missing += len(left) - len(arrived)
        delays_ms += arrived
    late = sum(delay > LATE_GOAL_MS for delay in delays_ms)
    name = f"{cars} cars at {RATE_HZ} Hz, each a process"
    yield f"{name}: commands at the board", f"{len(delays_ms):,}; {missing} overtaken by newer ones", "", ""
    shown = (
        f"p50 {median(delays_ms):.2f} ms, p99 {quantiles(delays_ms, n=100)[98]:.1f} ms, worst {max(delays_ms):.0f} ms"
    )
    yield f"{name}: later than {LATE_GOAL_MS} ms", f"{late} ({shown})", "0", result(late + missing, 0, least=False)


# Soak


async def _come_and_go(ports: list[int], end_s: float) -> None:
    while time.monotonic() < end_s:
        with suppress(OSError):
            _, writer = await asyncio.open_connection("127.0.0.1", ports[0])
            writer.write(b"\xff" * 9)
            await asyncio.sleep(0.02)
            writer.transport.abort()
        async with DriveClient("127.0.0.1", ports[0], telemetry_port=ports[1]) as watcher:
            await watcher.next_telemetry()


async def _drive_through(ports: list[int], end_s: float) -> None:
    async with DriveClient("127.0.0.1", ports[0], telemetry_port=ports[1]) as driver:
        while time.monotonic() < end_s:
            await driver.drive_for(1, 0.5, -0.3)


async def soak(ports: list[int], seconds: float) -> None:
    end_s = time.monotonic() + seconds
    await asyncio.gather(_drive_through(ports, end_s), *(_come_and_go(ports, end_s) for _ in range(3)))


def soak_rows(seconds: float) -> Rows:
    with server_process("idle") as car:
        process = psutil.Process(car.pid)

        def state() -> tuple[int, int, int]:
            # The car still notices the last connections that ended.
            time.sleep(SETTLE_S)
            return process.memory_info().rss, process.num_fds(), process.num_threads()

        asyncio.run(soak(car.ports, SOAK_WARM_S))
        before = state()
        asyncio.run(soak(car.ports, seconds))
        after = state()
    grown = after[0] / before[0]
    memory = f"{before[0] / 2**20:.1f} to {after[0] / 2**20:.1f} MiB"
    yield f"{seconds:g} s of coming and going: memory", memory, f"≤ {SOAK_GOAL}×", result(grown, SOAK_GOAL, least=False)
    left = after[1] - before[1] + after[2] - before[2]
    yield "… files and threads left over", str(left), "0", result(left, 0, least=False)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="shorter, less steady")
    parser.add_argument("--soak", type=float, default=0, metavar="SECONDS", help="measure growth alone")
    options = parser.parse_args()
    table = Table("", "figure", "goal", "result", title="Driving a car over loopback")
    if options.soak:
        rows = [*soak_rows(options.soak)]
    else:
        with tempfile.TemporaryDirectory() as folder:
            keys = Path(folder)
            make_keys(keys, [CarKeys("ada")], ["lin"], datetime.now(UTC))
            rows = [*trip_rows(keys, 5 if options.quick else TURNS)]
        rows += failsafe_rows(120 if options.quick else CUTS)
        rows += end_rows(20 if options.quick else 100)
        rows += many_rows(20 if options.quick else CARS)
    for row in rows:
        table.add_row(*row)
    Console().print(table)


if __name__ == "__main__":
    main()
