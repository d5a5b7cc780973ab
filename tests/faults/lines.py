"""Simulated lines for uploads: a serial cable that damages bytes and is pulled, and a TCP port."""

from collections.abc import Callable
from dataclasses import dataclass
from errno import EIO
from random import Random

from serial import SerialException, SerialTimeoutException
from tests.faults.network import Network, Socket
from tests.faults.world import Thread, World, here, world

# What the system's driver of a serial port stores.
_DRIVER_BYTES = 4096
_READ_TIMEOUT_S = 0.02


@dataclass
class Damage:
    """What happens to the bytes of one direction: chances for each byte, and which are lost in any case."""

    dropped: float = 0.0
    doubled: float = 0.0
    flipped: float = 0.0
    dead_from: int = 1 << 60
    dead_until: int = 1 << 60


class Cable:
    """A serial cable between a computer and a car, each with its `CableEnd`.

    Attributes:
        is_pulled: whether the ports are gone.
        pulls: how often that happened.
        delay_s: how long bytes take, besides the time of the line.
    """

    def __init__(self, room: World, random: Random, damages: tuple[Damage, Damage], baud: int) -> None:
        self.world = room
        self.is_pulled = False
        self.pulls = 0
        self.delay_s = 0.0
        self.byte_s = 10 / baud
        self.ends = [CableEnd(self, random, damage) for damage in damages]
        for end, other in zip(self.ends, reversed(self.ends), strict=True):
            end.other = other

    def pull(self) -> None:
        """Pull the cable out."""
        self.world.count("pulled cable")
        self.world.note("pull")
        self.is_pulled = True
        self.pulls += 1
        for end in self.ends:
            end.received.clear()
            end.wake()

    def plug(self) -> None:
        self.world.note("plug")
        self.is_pulled = False


class CableEnd:
    """One end: a port as pyserial has it; it reads what the other end has written."""

    other: "CableEnd"

    def __init__(self, cable: Cable, random: Random, damage: Damage) -> None:
        self._cable = cable
        self._random = random
        self.damage = damage
        self.received = bytearray()
        self.wrote: Callable[[bytes], None] = lambda data: None
        self.timeout_s = 0.0
        self._pulls = 0
        self._count = 0
        self._free_s = 0.0
        self._reader: Thread | None = None

    def open(self, timeout_s: float) -> "CableEnd":
        """Open the port; one that went away stays so until it is opened again. Raises SerialException."""
        if self._cable.is_pulled:
            raise SerialException("no such port")
        self.timeout_s, self._pulls = timeout_s, self._cable.pulls
        return self

    @property
    def in_waiting(self) -> int:
        self._check()
        return len(self.received)

    def read(self, count: int = 1) -> bytes:
        self._check()
        if not self.received and self.timeout_s:
            self.wait(self.timeout_s)
        self._check()
        data = bytes(self.received[:count])
        del self.received[:count]
        return data

    def write(self, data: bytes) -> int:
        self._check()
        room = self._cable.world
        self.wrote(data)
        came = self._damaged(data)
        begin_s = max(room.now_s, self._free_s)
        self._free_s = begin_s + len(data) * self._cable.byte_s
        # The bytes of a write come in two pieces.
        cut = self._random.randrange(len(came) + 1) if came else 0
        for piece, share in ((came[:cut], cut / (len(came) or 1)), (came[cut:], 1.0)):
            if piece:
                at_s = begin_s + share * len(data) * self._cable.byte_s + self._cable.delay_s
                room.at(at_s, lambda piece=piece: self.other.take(piece))
        return len(data)

    def flush(self) -> None:
        left_s = self._free_s - self._cable.world.now_s
        if left_s > 0:
            world().sleep(left_s)

    def close(self) -> None:
        pass

    def __enter__(self) -> "CableEnd":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def take(self, data: bytes) -> None:
        """Bytes have come."""
        if not self._is_gone:
            self.received += data
            del self.received[_DRIVER_BYTES:]
            self.wake()

    def wait(self, seconds: float) -> None:
        """Wait until bytes are there, or for a time."""
        if not self.received:
            self._reader = world().current
            world().wait(seconds)
            self._reader = None

    def wake(self) -> None:
        if self._reader:
            self._cable.world.wake(self._reader)

    @property
    def _is_gone(self) -> bool:
        return self._cable.is_pulled or self._pulls != self._cable.pulls

    def _check(self) -> None:
        if self._is_gone:
            raise SerialException(EIO, "Input/output error")

    def _damaged(self, data: bytes) -> bytes:
        damage, random, came = self.damage, self._random, bytearray()
        for byte in data:
            self._count += 1
            if damage.dead_from < self._count <= damage.dead_until:
                continue
            draw = random.random()
            if draw < damage.dropped:
                continue
            if draw < damage.dropped + damage.flipped:
                byte ^= 1 << random.randrange(8)
            came.append(byte)
            if draw > 1 - damage.doubled:
                came.append(byte)
        return bytes(came)


class SocketPort:
    """A TCP connection to a car, as pyserial's ``socket://`` has it."""

    def __init__(self, network: Network, host: str, port: int) -> None:
        reader = world().current
        assert reader
        found: list[Socket | OSError] = []

        def done(result: Socket | OSError) -> None:
            found.append(result)
            world().wake(reader)

        network.connect(here(), host, port, done)
        while not found:
            world().wait()
        if isinstance(found[0], OSError):
            raise SerialException(f"Could not open port: {found[0]}")
        self._socket = found[0]
        self._socket.changed = lambda: world().wake(reader)

    @property
    def in_waiting(self) -> int:
        return 1 if self._socket.received else 0

    def read(self, count: int = 1) -> bytes:
        socket = self._socket
        if not socket.received and not socket.has_ended and not socket.error:
            world().wait(_READ_TIMEOUT_S)
        try:
            data = socket.recv(count)
        except BlockingIOError:
            return b""
        except OSError as problem:
            raise SerialException(f"connection failed ({problem})") from None
        if not data:
            raise SerialException("socket disconnected")
        return data

    def write(self, data: bytes) -> int:
        end_s = world().now_s + 5
        while data:
            try:
                data = data[self._socket.send(data) :]
            except BlockingIOError:
                if world().now_s >= end_s:
                    raise SerialTimeoutException("Write timeout") from None
                world().wait(_READ_TIMEOUT_S)
            except OSError as problem:
                raise SerialException(f"connection failed ({problem})") from None
        return 0

    def flush(self) -> None:
        pass

    def __enter__(self) -> "SocketPort":
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()
