"""Listen at an address, and accept connections there: at most so many at a time, and so many of one address.

A TLS handshake costs a thousand times what it costs a stranger to ask for one. So connections by TLS wait until it is
their turn, without costing anything: first until their client says something, since ours listens for a while before it
does. Then one network has its turn after the other, and in each the newest connection, whose client still waits.
Networks with fewer half handshakes come first, so those from many addresses soon wait behind everybody else.
Handshakes begin one by one, and take half of the time of the event loop.
"""

import asyncio
import errno
import socket
import ssl
from collections import Counter, deque
from collections.abc import Callable
from contextlib import suppress
from typing import NamedTuple, Protocol, cast

from motorcade.errors import MotorcadeError, Phrase
from motorcade.sockets import listen, network_of

HANDSHAKE_S = 2.0
# Little is buffered by the system, so that a stall leaves few old commands and little old telemetry.
_KERNEL_BYTES = 1 << 13
_OUT_OF_SOCKETS_S = 0.1
# So many connections are accepted in a round of the event loop.
_MOST_AT_ONCE = 32
# So many connections wait for their handshakes.
_MOST_WAITING = 256
# Of so many networks half handshakes are counted.
_MOST_COUNTED = 4096
# The least time between two handshakes, and how often the event loop goes round until one has been answered.
_LEAST_GAP_S = 0.001
_ROUNDS = 5
# For so long a connection's first bytes may be on their way.
_YOUNG_S = 2.0
# A peer that has vanished is noticed in ten seconds, where the system has these options.
_KEEPALIVE = (("TCP_KEEPIDLE", 4), ("TCP_KEEPINTVL", 2), ("TCP_KEEPCNT", 3))


class PortTakenError(MotorcadeError):
    """Another program listens at the port."""


def bind(host: str, port: int, program: str = "car") -> socket.socket:
    """A socket that listens at an address of this computer.

    Args:
        host: name or address; 0.0.0.0 is all.
        port: 0 takes a free one.
        program: what listens, for the sentence of an error: "car", "remote" or "studio".

    Raises:
        PortTakenError: another program listens there.
        MotorcadeError: "no-local-address" or "address-unusable".
    """
    who = Phrase(f"program-{program}")
    try:
        return listen(host, port)
    except (socket.gaierror, UnicodeError):
        raise MotorcadeError("no-local-address", host=host[:60]) from None
    except OSError as problem:
        if problem.errno == errno.EADDRINUSE:
            raise PortTakenError("port-taken", port=port, program=who) from None
        raise MotorcadeError("address-unusable", program=who, host=host[:60], port=port, reason=problem) from None


class Places(NamedTuple):
    """How many connections a listener keeps: in all, and of one address; and how many may wait to be accepted.

    Attributes:
        most, most_of_one_address: an IPv6 network (/64) counts as one address.
        waiting: a newcomer who finds so many waiting tries again after a second. 0: as many as are kept.
        burst: so many times as many connections of an address are kept while all have a session, or are new.
        shares: whether a newcomer gets a place even where all have sessions: one of whoever has most.
    """

    most: int = 64
    most_of_one_address: int = 16
    waiting: int = 0
    burst: int = 1
    shares: bool = False


# A car accepts thousands in a second: nobody's emergency stop has to try again.
DRIVE_PLACES = Places(waiting=socket.SOMAXCONN)


class Connected(Protocol):
    """What a listener needs of the protocol of a connection."""

    # Who is known to hold the connection; their connections don't count for the address. "": nobody is known.
    holder: str
    # Whether it stays, however many newcomers there are.
    stays: bool

    def has_session(self) -> bool:
        """Whether the connection stays when newcomers need its place."""

    def drop(self) -> None:
        """End the connection at once, if it has begun."""


MakeProtocol = Callable[[Callable[[], None]], Connected]


class _Slot:
    """The place of one connection."""

    def __init__(self, address: str, make_protocol: "MakeProtocol", free: "Callable[[_Slot], None]") -> None:
        self.network = network_of(address)
        self.made_s = asyncio.get_running_loop().time()
        self.protocol = make_protocol(lambda: free(self))
        self.opening: asyncio.Task[None] | None = None

    def whose(self) -> str:
        """Return who has it: somebody who is known, or a network."""
        return self.protocol.holder or self.network

    def end(self) -> None:
        if self.opening:
            self.opening.cancel()
        self.protocol.drop()


class Listener:
    """Accept connections at one socket, at most as many at a time as there are places.

    When all places are taken a newcomer replaces the oldest connection without a session, one of its own address
    first. So drivers and watchers stay, and a new driver gets in while somebody floods the socket.

    Args:
        listener: bound and listening.
        make_protocol: makes the protocol of a connection, given what it has to call when the connection is lost.
        turned_away: called for each connection that got or kept no place, or failed to prove who it is.
        tls: for connections by TLS.
        places: how many connections it keeps.
    """

    def __init__(
        self,
        listener: socket.socket,
        make_protocol: MakeProtocol,
        turned_away: Callable[[], None],
        tls: ssl.SSLContext | None = None,
        places: Places = DRIVE_PLACES,
    ) -> None:
        self._listener = listener
        self._make_protocol = make_protocol
        self._tls = tls
        self._turned_away = turned_away
        self._places = places
        self._slots: list[_Slot] = []
        # Connections that wait for their handshake, by network; whose turn it is, is the first.
        # Before them those whose client has said nothing yet, and what ends their time.
        self._mute: dict[socket.socket, tuple[str, asyncio.TimerHandle]] = {}
        self._waiting: dict[str, deque[tuple[socket.socket, str]]] = {}
        self._has_waiting = asyncio.Event()
        # Handshakes that a network's clients began and didn't end, since one of them was whole. They have cost as much
        # where the client has left.
        self._halves = Counter[str]()
        listener.setblocking(False)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _KERNEL_BYTES)
        listener.listen(places.waiting or places.most)

    @property
    def address(self) -> tuple[str, int]:
        """Host and port at which it listens."""
        host, port = self._listener.getsockname()[:2]
        return str(host), int(port)

    async def serve(self) -> None:
        """Accept until cancelled; then accept nobody any more."""
        admitting = asyncio.create_task(self._admit())
        try:
            while True:
                try:
                    line, address = await self._next()
                except OSError:
                    # Out of sockets: some connection will end.
                    await asyncio.sleep(_OUT_OF_SOCKETS_S)
                    continue
                if self._tls:
                    self._await_hello(line, str(address[0]))
                    self._await_more_hellos()
                else:
                    self._accept(line, str(address[0]))
                # While newcomers wait, sock_accept doesn't yield, and the open connections would get no turn.
                await asyncio.sleep(0)
        finally:
            self._listener.close()
            admitting.cancel()
            for line in list(self._mute):
                self._end_mute(line)
                line.close()
            for waiting in self._waiting.values():
                for line, _ in waiting:
                    line.close()
            self._waiting.clear()

    def close_to_newcomers(self) -> None:
        """Accept nobody any more; to be called before `serve` is cancelled."""
        # A selector's loop would accept one more for a cancelled sock_accept, and lose it; Windows' has no readers.
        with suppress(NotImplementedError):
            asyncio.get_running_loop().remove_reader(self._listener)

    def drop_all(self) -> None:
        """End all connections; to be called when `serve` has ended."""
        for slot in list(self._slots):
            slot.end()

    async def _next(self) -> tuple[socket.socket, tuple[str, int]]:
        """The next connection. Raises OSError."""
        accepting = asyncio.ensure_future(asyncio.get_running_loop().sock_accept(self._listener))
        try:
            return await asyncio.shield(accepting)
        except asyncio.CancelledError:
            # A connection that was accepted at this moment would stay open without an owner.
            await asyncio.sleep(0)
            if accepting.done() and accepting.exception() is None:
                accepting.result()[0].close()
            accepting.cancel()
            raise

    def _await_more_hellos(self) -> None:
        """Accept those who wait now, a few at most.

        A round of the event loop may last for a handshake. One newcomer a round would let a flood fill the system's
        queue, in which everybody waits.
        """
        for _ in range(_MOST_AT_ONCE):
            try:
                line, address = self._listener.accept()
            except OSError:
                return
            line.setblocking(False)
            self._await_hello(line, str(address[0]))

    def _await_hello(self, line: socket.socket, address: str) -> None:
        """Let a connection wait until its client says something, at most as long as for a handshake."""
        loop = asyncio.get_running_loop()

        def come() -> None:
            self._end_mute(line)
            with suppress(OSError):
                if line.recv(1, socket.MSG_PEEK):
                    self._wait(line, address)
                    return
            line.close()

        def leave(line: socket.socket) -> None:
            self._end_mute(line)
            line.close()
            self._turned_away()

        try:
            loop.add_reader(line, come)
        except NotImplementedError:
            # Windows' loop tells nothing of it.
            self._wait(line, address)
            return
        self._mute[line] = network_of(address), loop.call_later(HANDSHAKE_S, leave, line)
        if len(self._mute) > _MOST_WAITING:
            most = Counter(network for network, _ in self._mute.values()).most_common(1)[0][0]
            leave(next(other for other, (network, _) in self._mute.items() if network == most))

    def _end_mute(self, line: socket.socket) -> None:
        asyncio.get_running_loop().remove_reader(line)
        self._mute.pop(line)[1].cancel()

    def _wait(self, line: socket.socket, address: str) -> None:
        """Let a connection wait for its handshake; where too many wait the oldest of whoever has most gives way."""
        most_of_one = self._places.most_of_one_address * self._places.burst
        queue = self._waiting.setdefault(network_of(address), deque())
        queue.append((line, address))
        count = sum(map(len, self._waiting.values()))
        if count > _MOST_WAITING:
            # Of networks that have as many, and as many halves, the last: the others have waited longer.
            most = max(reversed(self._waiting), key=lambda other: (len(self._waiting[other]), self._halves[other]))
            queue = self._waiting[most]
        if count > _MOST_WAITING or len(queue) > most_of_one:
            queue.popleft()[0].close()
            self._turned_away()
        self._has_waiting.set()

    async def _admit(self) -> None:
        """Begin handshakes in turn, until cancelled."""
        clock = asyncio.get_running_loop().time
        while True:
            await self._has_waiting.wait()
            begin_s = clock()
            network = min(self._waiting, key=self._halves.__getitem__, default="")
            queue = self._waiting.pop(network, deque())
            if not queue:
                if not self._waiting:
                    self._has_waiting.clear()
                continue
            self._accept(*queue.pop())
            if queue:
                self._waiting[network] = queue
            for _ in range(_ROUNDS):
                await asyncio.sleep(0)
            await asyncio.sleep(max(_LEAST_GAP_S, clock() - begin_s))

    def _accept(self, line: socket.socket, address: str) -> None:
        if not self._make_room(address):
            self._turned_away()
            line.close()
            return
        with suppress(OSError):
            _set_options(line)
        slot = _Slot(address, self._make_protocol, self._free)
        if len(self._halves) >= _MOST_COUNTED:
            self._halves.clear()
        self._halves[slot.network] += 1
        self._slots.append(slot)
        slot.opening = asyncio.ensure_future(self._open(line, slot.protocol))
        slot.opening.add_done_callback(lambda opening: self._opened(opening, line, slot))

    def _free(self, slot: _Slot) -> None:
        if slot in self._slots:
            self._slots.remove(slot)

    def _make_room(self, address: str) -> bool:
        """End a connection where there is no place. False where all have sessions, and none has to give way."""
        places = self._places
        network = network_of(address)
        alike = [slot for slot in self._slots if slot.network == network and not slot.protocol.holder]
        wants_keys = self._tls is not None and self._tls.verify_mode == ssl.CERT_REQUIRED
        if wants_keys:
            # Whoever has only begun a handshake may have any place that nobody else needs, for as long.
            alike = [slot for slot in alike if not slot.opening]
        if len(alike) < places.most_of_one_address and len(self._slots) < places.most:
            return True
        is_burst = len(alike) < places.most_of_one_address * places.burst
        candidates = self._slots
        if len(alike) >= places.most_of_one_address:
            candidates = alike
        # In a burst requests are on their way.
        since_s = asyncio.get_running_loop().time() - (_YOUNG_S if is_burst and places.burst > 1 else 0.0)
        idle = [slot for slot in candidates if not slot.protocol.has_session() and slot.made_s <= since_s]
        if wants_keys:
            # Who has shown keys stays longer than who has only begun a handshake.
            idle = [slot for slot in idle if slot.opening] or idle
        # One of whoever has most of them, so that a flood replaces its own.
        counts = Counter(slot.network for slot in idle)
        oldest = max(idle, key=lambda slot: (counts[slot.network], self._halves[slot.network]), default=None)
        if oldest is None and is_burst:
            if len(self._slots) < places.most:
                return True
            if places.shares:
                oldest = self._oldest_of_many()
        if oldest is None:
            return False
        self._turned_away()
        self._free(oldest)
        oldest.end()
        return True

    def _oldest_of_many(self) -> _Slot | None:
        """The oldest connection of whoever has most, except those that stay; None where everybody has one."""
        slots = [slot for slot in self._slots if not slot.protocol.stays]
        counts = Counter(slot.whose() for slot in slots)
        whose, count = max(counts.items(), key=lambda waiting: waiting[1], default=("", 0))
        if count > 1:
            return next(slot for slot in slots if slot.whose() == whose)
        return None

    async def _open(self, line: socket.socket, protocol: Connected) -> None:
        timeout_s = None
        if self._tls:
            timeout_s = HANDSHAKE_S
        await asyncio.get_running_loop().connect_accepted_socket(
            lambda: cast(asyncio.BaseProtocol, protocol),
            line,
            ssl=self._tls,
            ssl_handshake_timeout=timeout_s,
            ssl_shutdown_timeout=timeout_s,
        )

    def _opened(self, opening: asyncio.Task[None], line: socket.socket, slot: _Slot) -> None:
        slot.opening = None
        if opening.cancelled():
            line.close()
        elif problem := opening.exception():
            # Wrong certificates, no TLS at all, or the client has left.
            if not isinstance(problem, OSError):
                raise problem
            self._turned_away()
            self._free(slot)
        else:
            del self._halves[slot.network]


def _set_options(line: socket.socket) -> None:
    line.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _KERNEL_BYTES)
    line.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    # Else the end of an answer waits up to 40 ms for the client to acknowledge its beginning. asyncio does this for
    # sockets of its own alone.
    line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    for name, value in _KEEPALIVE:
        if hasattr(socket, name):
            line.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)
