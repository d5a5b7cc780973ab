"""A TCP proxy that makes a bad network of a good one: for tests of both ends of a drive, and their benchmark."""

import asyncio
import contextlib
import struct
from socket import SO_LINGER, SOL_SOCKET

CHUNK_BYTES = 65536
_Writers = tuple[asyncio.StreamWriter, asyncio.StreamWriter]


class FaultProxy:
    """``async with FaultProxy(port) as proxy``: clients connect to ``proxy.port``, which leads to ``port``.

    Attributes:
        delay_s: how much later each chunk comes.
        is_held: whether nothing passes and nothing is lost, as in a frozen network.
        passed: what came, in its order: whether from the server, and the bytes.
    """

    def __init__(self, target_port: int, host: str = "127.0.0.1"):
        self.target = host, target_port
        self.delay_s, self.is_held, self.port = 0.0, False, 0
        self.passed: list[tuple[bool, bytes]] = []
        self._pairs: list[_Writers] = []
        self._dead: set[_Writers] = set()
        self._carrying: set[asyncio.Task[None]] = set()
        self._writers: list[asyncio.StreamWriter] = []
        self._changed = asyncio.Event()

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

    def hold(self, is_held: bool) -> None:
        """Freeze the network, or let it go on; any thread may call this."""
        self.is_held = is_held
        self._loop.call_soon_threadsafe(self._notify)

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
        self._dead |= set(self._pairs)

    def _notify(self) -> None:
        self._changed.set()
        self._changed = asyncio.Event()

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
                ways = (client_reader, server_writer), (server_reader, client_writer)
                await asyncio.gather(*(self._carry_way(*way, pair) for way in ways), return_exceptions=True)
            if pair in self._pairs:
                self._pairs.remove(pair)

    async def _carry_way(self, source: asyncio.StreamReader, target: asyncio.StreamWriter, pair: _Writers) -> None:
        """Pass on until the source ends; then end the target."""
        under_way: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue()
        delivery = asyncio.create_task(self._deliver(under_way, target, pair))
        try:
            chunk = b"not the end"
            while chunk:
                chunk = await source.read(CHUNK_BYTES)
                if chunk:
                    self.passed.append((target is pair[0], chunk))
                under_way.put_nowait((self._loop.time() + self.delay_s, chunk))
            await delivery
        finally:
            delivery.cancel()

    async def _deliver(
        self, under_way: asyncio.Queue[tuple[float, bytes]], target: asyncio.StreamWriter, pair: _Writers
    ) -> None:
        while True:
            due_s, chunk = await under_way.get()
            while (wait_s := due_s - self._loop.time()) > 0 or self.is_held or pair in self._dead:
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(wait_s if wait_s > 0 else None):
                        await self._changed.wait()
            if not chunk:
                target.write_eof()
                return
            target.write(chunk)
            await target.drain()
