"""A simulated network of TCP: what is sent arrives in order, some time later, at once with what waited, or never.

A `Link` lies between two computers and has faults; each connection over it is two `Socket`s, as the system has them:
bytes wait in the sender's buffer while the receiver reads none.
"""

from collections import deque
from collections.abc import Callable, Iterable
from errno import ECONNREFUSED, ECONNRESET, ENOTCONN, EPIPE, ETIMEDOUT
from os import strerror
from random import Random
from socket import SO_KEEPALIVE, SOL_SOCKET
from typing import Any

from tests.faults.selector import File
from tests.faults.world import Process, World

# What waits in the kernel of a sender, and of a receiver that doesn't read.
_SEND_BYTES, _RECEIVE_BYTES = 1 << 14, 1 << 14
# A lost packet is sent again after so long, then after twice as long.
_AGAIN_S = 0.2
# A peer that has vanished is noticed after so long, where keep-alive is on.
_KEEP_ALIVE_S = 10.0
_CONNECT_S = 60.0


class Link:
    """What lies between two computers.

    Attributes:
        delay_s, jitter_s: how long a packet takes.
        loss: the chance that one is lost, and sent again.
        down_until_s: until then nothing passes; what is sent meanwhile comes afterwards.
        late_until_s: until then comes what a stall or a loss has held up.
    """

    def __init__(self, world: World, delay_s: float, jitter_s: float, loss: float) -> None:
        self.world = world
        self.delay_s = delay_s
        self.jitter_s = jitter_s
        self.loss = loss
        self.down_until_s = self.late_until_s = 0.0
        self.sockets: list[Socket] = []

    def _note(self, what: str, *more: object) -> None:
        self.world.count(what)
        self.world.note(what, *more)

    def stall(self, seconds: float) -> None:
        """Let nothing pass for a time: a stall, or a pulled cable that is plugged in again."""
        self._note("stall", round(seconds, 4))
        self.down_until_s = max(self.down_until_s, self.world.now_s + seconds)

    def cut(self) -> None:
        """Break all connections: both ends get a reset."""
        self._note("cut")
        for socket in list(self.sockets):
            socket.fail(ECONNRESET)

    def forget_one_end(self, first: bool = True) -> None:
        """Break all connections so that only one end knows: the other finds out when it sends, or never.

        ``first``: whether those know who connected, or those who accepted.
        """
        self._note("half-open")
        for socket in list(self.sockets):
            if socket.is_first == first:
                socket.vanish()

    def arrival_s(self, chance: Random) -> float:
        """When a packet arrives that is sent now."""
        now_s = self.world.now_s
        at_s = max(now_s, self.down_until_s) + self.delay_s
        if self.jitter_s or self.loss:
            at_s += chance.random() * self.jitter_s
        again_s = _AGAIN_S
        is_late = now_s < self.down_until_s
        while self.loss and chance.random() < self.loss:
            at_s += again_s
            again_s *= 2
            is_late = True
        if is_late:
            self.late_until_s = max(self.late_until_s, at_s)
        return at_s


class Socket(File):
    """One end of a connection.

    Attributes:
        received: what has come and isn't read yet.
        has_ended: whether the peer sends nothing any more.
        error: why the connection is broken; 0 where it isn't.
        ended: called when it breaks, or is closed.
        tap: is given what is sent.
    """

    def __init__(self, network: "Network", link: Link, process: Process, address: tuple[str, int], first: bool) -> None:
        super().__init__(network.world)
        self.world = network.world
        self.link = link
        self.process = process
        self.address = address
        self.is_first = first
        self.peer: Socket | None = None
        self.received = bytearray()
        self.has_ended = False
        self.came_bytes = 0
        self.error = 0
        self.is_closed = False
        self.ended: Callable[[], None] = lambda: None
        self.tap: Callable[[bytes], None] | None = None
        # Makes the bytes that a program reads.
        self.make: Callable[[bytes], bytes] = bytes
        self.options: dict[tuple[int, int], int] = {}
        self._chance = Random(f"{self.world.seed} {address} {network.opened}")
        # What is under way, the oldest first, and when the last of it arrives; None is the end.
        self._packets: deque[bytes | None] = deque()
        self._last_s = 0.0
        self._under_way = 0
        link.sockets.append(self)
        process.at_end.append(self.close)

    # What a program calls.

    def send(self, data: bytes) -> int:
        """Send as much as there is room for; returns how much. Raises OSError, and BlockingIOError for no room."""
        if self.error:
            raise system_error(self.error)
        if self.is_closed or self.peer is None:
            raise system_error(EPIPE)
        count = min(self._room(), len(data))
        if count <= 0:
            raise BlockingIOError
        if self.tap:
            self.tap(bytes(data[:count]))
        self._under_way += count
        self._deliver(bytes(data[:count]))
        return count

    def sendmsg(self, parts: Iterable[bytes]) -> int:
        return self.send(b"".join(parts))

    def _room(self) -> int:
        return _SEND_BYTES + _RECEIVE_BYTES - self._under_way - len(self.peer.received) if self.peer else 1

    @property
    def is_readable(self) -> bool:
        return bool(self.received or self.has_ended or self.error)

    @property
    def is_writable(self) -> bool:
        return bool(self.error or self.is_closed or self._room() > 0)

    def recv(self, count: int, flags: int = 0) -> bytes:
        """What has come, at most so much; b"" at the end. Raises OSError, and BlockingIOError where nothing has."""
        if self.received:
            data = self.make(self.received[:count])
            if not flags:
                self.skip(len(data))
            return data
        if self.error:
            raise system_error(self.error)
        if self.has_ended:
            return b""
        raise BlockingIOError

    def recv_into(self, buffer: Any) -> int:
        data = self.recv(len(buffer))
        buffer[: len(data)] = data
        return len(data)

    def sendall(self, data: bytes) -> None:
        """Send all, where there is room for all."""
        self.send(data)

    def skip(self, count: int) -> None:
        """Remove bytes that were read; the peer may send as many."""
        del self.received[:count]
        if self.peer:
            self.world.after(self.link.delay_s, self.peer.changed_by_peer)

    def changed_by_peer(self) -> None:
        if not self.is_closed:
            self.changed()

    def close(self) -> None:
        """Send what waits, and the end."""
        if self.is_closed:
            return
        self.is_closed = True
        self.received.clear()
        self.process.at_end.remove(self.close)
        if self.peer and not self.error:
            self._deliver(None)
        self._forget()

    def getpeername(self) -> tuple[str, int]:
        if self.peer is None:
            raise system_error(ENOTCONN)
        return self.peer.address

    def getsockname(self) -> tuple[str, int]:
        return self.address

    def setsockopt(self, level: int, option: int, value: int) -> None:
        self.options[level, option] = value

    # What happens to it.

    def fail(self, code: int) -> None:
        """Break: whoever reads or sends gets an error."""
        if not self.error and not self.is_closed:
            self.error = code
            self._forget()
            self.changed()

    def vanish(self) -> None:
        """Be gone without a word: the peer's bytes come to nothing."""
        peer = self.peer
        self.peer = None
        self.fail(ECONNRESET)
        if peer:
            peer.peer = _Nothing(peer)
            if peer.options.get((SOL_SOCKET, SO_KEEPALIVE)):
                self.world.after(_KEEP_ALIVE_S, lambda: peer.fail(ETIMEDOUT))

    def _deliver(self, data: bytes | None) -> None:
        self._packets.append(data)
        self._expect()

    def _expect(self) -> None:
        self._last_s = max(self._last_s + 1e-9, self.link.arrival_s(self._chance))
        self.world.at(self._last_s, self._arrive)

    def _arrive(self) -> None:
        """The oldest packet arrives."""
        peer = self.peer
        if peer is None or self.error or peer.error:
            return
        if self.world.now_s < self.link.down_until_s:
            self._expect()
            return
        data = self._packets.popleft()
        if data is None:
            peer.has_ended = True
        else:
            self._under_way -= len(data)
            if peer.is_closed:
                self.world.after(self.link.delay_s, lambda: self.fail(ECONNRESET))
                return
            peer.received += data
            peer.came_bytes += len(data)
        if not peer.is_closed:
            peer.changed()

    def _forget(self) -> None:
        if self in self.link.sockets:
            self.link.sockets.remove(self)
            self.ended()


class _Nothing:
    """Nobody is there any more; what is sent to it is lost."""

    error = ECONNRESET
    is_closed = True

    def __init__(self, of: Socket) -> None:
        self.received = b""
        self.address = ("?", 0)
        self.options: dict[tuple[int, int], int] = {}
        self.changed_by_peer = lambda: None


class ListeningSocket(File):
    """A socket at which a program accepts connections."""

    def __init__(self, network: "Network", process: Process, address: tuple[str, int], backlog: int) -> None:
        super().__init__(network.world)
        self._network = network
        self.process = process
        self._address = address
        self._backlog = backlog
        self._waiting: deque[Socket] = deque()
        process.at_end.append(self.close)

    def listen(self, backlog: int) -> None:
        self._backlog = backlog

    def accept(self) -> tuple[Socket, tuple[str, int]]:
        """The next connection. Raises BlockingIOError where none waits."""
        if not self._waiting:
            raise BlockingIOError
        socket = self._waiting.popleft()
        return socket, socket.getpeername() if socket.peer else ("?", 0)

    def take(self, socket: Socket) -> bool:
        """Let a connection wait to be accepted. False where too many do."""
        if len(self._waiting) > self._backlog:
            return False
        self._waiting.append(socket)
        self.changed()
        return True

    @property
    def count(self) -> int:
        """How many connections wait to be accepted."""
        return len(self._waiting)

    @property
    def is_readable(self) -> bool:
        return bool(self._waiting)

    def close(self) -> None:
        if self._network.listening.get(self._address) is self:
            del self._network.listening[self._address]
            self.process.at_end.remove(self.close)
        for socket in self._waiting:
            socket.close()

    def getsockname(self) -> tuple[str, int]:
        return self._address

    def setsockopt(self, level: int, option: int, value: int) -> None:
        pass


Connected = Callable[[Socket | OSError], None]


class Network:
    """All computers, by name, and the links between them and the one that serves."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.links: dict[str, Link] = {}
        self.listening: dict[tuple[str, int], ListeningSocket] = {}
        # Other names of computers.
        self.names: dict[str, str] = {}
        # Told of each connection: its name, its port, and the client's end.
        self.watch: Callable[[str, int, Socket], None] = lambda name, port, socket: None
        # Told of each try: who tries, and where.
        self.knocks: Callable[[str, str, int], None] = lambda name, host, port: None
        self.opened = 0

    def link(self, host: str, delay_s: float, jitter_s: float = 0.0, loss: float = 0.0) -> Link:
        """The link of a computer to all others, or, as ``A to B``, to one of them."""
        self.links[host] = Link(self.world, delay_s, jitter_s, loss)
        return self.links[host]

    def listen(self, process: Process, host: str, port: int, backlog: int = 128) -> ListeningSocket:
        """Listen at an address."""
        socket = ListeningSocket(self, process, (host, port), backlog)
        self.listening[host, port] = socket
        return socket

    def connect(self, process: Process, host: str, port: int, done: Connected, name: str = "") -> None:
        """Connect a process to an address; ``done`` gets the socket, or why not.

        ``name`` is that of its computer: the process's own unless given.
        """
        host = self.names.get(host, host)
        world, to, name = self.world, (host, port), name or process.name
        self.knocks(name, host, port)
        link = self.links.get(f"{name} to {host}") or self.links.get(name) or self.links[process.name]
        self.opened += 1
        address = name, 40_000 + self.opened
        chance, end_s = Random(f"{world.seed} connects {address}"), world.now_s + _CONNECT_S

        def knock() -> None:
            """A packet knocks until somebody answers."""
            if process.is_dead:
                return
            if world.now_s < link.down_until_s:
                if world.now_s < end_s:
                    world.after(1.0, knock)
                else:
                    done(system_error(ETIMEDOUT))
                return
            listening = self.listening.get(to)
            if listening is None or listening.process.is_dead:
                world.at(link.arrival_s(chance), done, system_error(ECONNREFUSED))
                return
            ours, theirs = Socket(self, link, process, address, True), Socket(self, link, listening.process, to, False)
            ours.peer, theirs.peer = theirs, ours
            if not listening.take(theirs):
                for socket in (ours, theirs):
                    socket.peer = None
                    socket.close()
                world.after(1.0, knock)
                return
            self.watch(name, port, ours)
            world.at(link.arrival_s(chance), done, ours)

        world.at(link.arrival_s(chance), knock)


def system_error(code: int) -> OSError:
    """The error of the system with that number."""
    return OSError(code, strerror(code))
