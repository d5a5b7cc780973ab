"""A TCP proxy that makes a bad network of a good one: for tests of both ends of a drive, and their benchmark.

It stands between client and server in an event loop and passes chunks on as its faults say, each way by itself. What
the kernel's netem would do to packets it does to chunks: a lost packet stalls a TCP connection until it is sent again,
so a 'loss' here is a stall of everything behind it.
"""

import asyncio
import contextlib
import random
import struct
from dataclasses import dataclass
from socket import SO_LINGER, SOL_SOCKET

CHUNK_BYTES = 65536
_Writers = tuple[asyncio.StreamWriter, asyncio.StreamWriter]


@dataclass
class Faults:
    """What is wrong with the network now; `FaultProxy.set_both` changes it at once, also for chunks under way.

    Attributes:
        delay_s, jitter_s: each chunk comes so late, and up to so much later.
        loss, retransmit_s: chances that a chunk is 'lost', and how long all then waits for it.
        reorder: chances that a chunk swaps places with the one behind it, as no TCP does, but broken boxes do.
        split: the most bytes that arrive in one piece; 0 leaves pieces as they are.
        held: nothing passes and nothing is lost: a frozen network.
    """

    delay_s: float = 0.0
    jitter_s: float = 0.0
    loss: float = 0.0
    retransmit_s: float = 0.2
    reorder: float = 0.0
    split: int = 0
    held: bool = False


class FaultProxy:
    """``async with FaultProxy(port) as proxy``: clients connect to ``proxy.port``, which leads to ``port``.

    Attributes:
        up, down: Faults on the way to the server and back from it.
        seed: the same seed meets the same chunks with the same faults.
    """

    def __init__(self, target_port: int, host: str = "127.0.0.1", seed: int = 0):
        self.target = host, target_port
        self.up, self.down = Faults(), Faults()
        self.port = 0
        self._random = random.Random(seed)
        self._pairs: list[_Writers] = []
        self._ways: list[_Way] = []
        self._carrying: set[asyncio.Task[None]] = set()
        self._writers: list[asyncio.StreamWriter] = []
        self._changed = _Change()

    async def __aenter__(self) -> "FaultProxy":
        self._loop = asyncio.get_running_loop()
        self._server = await asyncio.start_server(self._accept, "127.0.0.1", 0)
        self.port = self._server.sockets[0].getsockname()[1]
        return self

    async def __aexit__(self, *problem: object) -> None:
        self._server.close()
        self.cut()
        # One may be connecting to the server just now; another one hasn't begun, so it would close nothing.
        for task in self._carrying:
            task.cancel()
        await asyncio.gather(*self._carrying, return_exceptions=True)
        for writer in self._writers:
            writer.transport.abort()
        await asyncio.gather(*(writer.wait_closed() for writer in self._writers), return_exceptions=True)

    @property
    def connections(self) -> int:
        """How many are open."""
        return len(self._pairs)

    @property
    def up_waiting(self) -> int:
        """How many chunks are under way to the server."""
        return sum(way.waiting for way in self._ways[::2])

    def set_both(self, **faults: object) -> None:
        """Set faults of both ways; any thread may call this."""
        for name, value in faults.items():
            setattr(self.up, name, value)
            setattr(self.down, name, value)
        self._loop.call_soon_threadsafe(self._changed.notify)

    def cut(self, reset: bool = True) -> None:
        """End all connections at both ends: by RST, as a crash does, or by FIN."""
        for pair in self._pairs:
            for writer in pair:
                if reset:
                    # The other end may have closed it already.
                    with contextlib.suppress(OSError):
                        writer.get_extra_info("socket").setsockopt(SOL_SOCKET, SO_LINGER, struct.pack("ii", 1, 0))
                    writer.transport.abort()
                else:
                    writer.close()
        self._pairs.clear()

    def half_open(self) -> None:
        """From now on the open connections lose everything, their ends too, as behind a pulled cable."""
        for way in self._ways:
            way.dead = True

    def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._writers.append(writer)
        task = asyncio.create_task(self._carry(reader, writer))
        self._carrying.add(task)
        task.add_done_callback(self._carrying.discard)

    async def _carry(self, client_reader: asyncio.StreamReader, client_writer: asyncio.StreamWriter) -> None:
        with contextlib.closing(client_writer):
            try:
                server_reader, server_writer = await asyncio.open_connection(*self.target)
            except OSError:
                client_writer.transport.abort()
                return
            self._writers.append(server_writer)
            pair = client_writer, server_writer
            self._pairs.append(pair)
            with contextlib.closing(server_writer):
                await self._carry_both(client_reader, server_reader, pair)
            if pair in self._pairs:
                self._pairs.remove(pair)

    async def _carry_both(
        self, client_reader: asyncio.StreamReader, server_reader: asyncio.StreamReader, writers: _Writers
    ) -> None:
        client_writer, server_writer = writers
        ways = [
            _Way(self.up, self._changed, self._random, client_reader, server_writer),
            _Way(self.down, self._changed, self._random, server_reader, client_writer),
        ]
        self._ways.extend(ways)
        await asyncio.gather(*(way.carry() for way in ways), return_exceptions=True)


class _Change:
    """Wakes all that wait when the faults have changed."""

    def __init__(self) -> None:
        self._event = asyncio.Event()

    def notify(self) -> None:
        self._event.set()
        self._event = asyncio.Event()

    async def wait(self, seconds: float | None) -> None:
        """Wait for a change, at most for a time."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                await self._event.wait()


class _Way:
    """One direction of one connection."""

    def __init__(
        self,
        faults: Faults,
        changed: _Change,
        random_source: random.Random,
        source: asyncio.StreamReader,
        target: asyncio.StreamWriter,
    ):
        self._faults, self._changed, self._random = faults, changed, random_source
        self._source, self._target = source, target
        self._under_way: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue()
        self.dead = False

    @property
    def waiting(self) -> int:
        """How many chunks are under way."""
        return self._under_way.qsize()

    async def carry(self) -> None:
        """Pass on until the source ends; then end the target."""
        delivery = asyncio.create_task(self._deliver())
        try:
            while chunk := await self._source.read(CHUNK_BYTES):
                self._send(chunk)
            self._send(b"")
            await delivery
        finally:
            delivery.cancel()

    def _send(self, chunk: bytes) -> None:
        faults = self._faults
        size = faults.split or len(chunk) or 1
        for begin in range(0, max(len(chunk), 1), size):
            late_s = faults.delay_s + self._random.random() * faults.jitter_s
            if self._random.random() < faults.loss:
                late_s += faults.retransmit_s
            due_s = asyncio.get_running_loop().time() + late_s
            self._under_way.put_nowait((due_s, chunk[begin : begin + size]))

    async def _deliver(self) -> None:
        late: bytes | None = None
        while True:
            due_s, chunk = await self._under_way.get()
            await self._until(due_s)
            if chunk and late is None and self._random.random() < self._faults.reorder:
                late = chunk
                continue
            self._target.write(chunk + (late or b""))
            late = None
            if not chunk:
                self._target.write_eof()
                return
            await self._target.drain()

    async def _until(self, due_s: float) -> None:
        """Wait for the time, while the network is held, and for ever behind a pulled cable."""
        while (wait_s := due_s - asyncio.get_running_loop().time()) > 0 or self._faults.held or self.dead:
            await self._changed.wait(wait_s if wait_s > 0 else None)
