"""The car's end of a connection that brings commands: four bytes each, and nothing goes back."""

import asyncio
import struct
from collections.abc import Callable
from typing import TYPE_CHECKING

from motorcade.drive.drive_failures import DriveError
from motorcade.drive.listener import ClientProtocol
from motorcade.drive.telemetry import Counts
from motorcade.drive.tls.keys import peer_name
from motorcade.words.field import WordError

if TYPE_CHECKING:
    from motorcade.drive.server import DriveServer
    from motorcade.drive.session import ControlSession

_WORD_BYTES = 4
# A thousand commands, which nobody sends between two looks of ours but by mistake.
_BUFFER_BYTES = 4096
MOST_WRONG = 16


class CommandChannel(ClientProtocol, asyncio.BufferedProtocol):
    """One client's commands.

    Attributes:
        client: who it is: the name in its certificate, or the address that it comes from.
        port: the port that it comes from.
        seat: its seat, once it has sent a command.
        counts: what became of its words.
    """

    def __init__(self, left: Callable[[ClientProtocol], None], server: "DriveServer", byte_order: str) -> None:
        super().__init__(left)
        self.client = ""
        self.port = 0
        self.seat: ControlSession | None = None
        self.counts = Counts()
        self._server = server
        self._unpack = struct.Struct(">I" if byte_order == "big" else "<I").unpack_from
        self._buffer = bytearray(_BUFFER_BYTES)
        self._view = memoryview(self._buffer)
        self._rest = b""
        self._wrong = 0

    @property
    def name(self) -> str:
        """What others are shown."""
        return f"{self.client}:{self.port}"

    def is_seated(self) -> bool:
        """Whether it drives or watches."""
        return self.seat is not None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Note who comes."""
        super().connection_made(transport)
        address = transport.get_extra_info("peername") or ("?", 0)
        self.client, self.port = client_of(transport), int(address[1])
        self._server.commands.append(self)

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop the wheels, if this one moved them."""
        if self in self._server.commands:
            self._server.commands.remove(self)
        if self.seat:
            self.seat.leave()
        super().connection_lost(exc)

    def get_buffer(self, sizehint: int) -> memoryview:
        """Where the bytes go."""
        return self._view

    def buffer_updated(self, nbytes: int) -> None:
        """Take the newest whole command of what has come."""
        if nbytes == _WORD_BYTES and not self._rest:
            self._take(self._unpack(self._buffer)[0])
            return
        data = self._rest + self._buffer[:nbytes]
        whole = len(data) // _WORD_BYTES
        self._rest = bytes(data[whole * _WORD_BYTES :])
        # Behind a full buffer lie newer ones.
        is_newest = nbytes < _BUFFER_BYTES
        if whole:
            self._take(self._unpack(data, (whole - 1) * _WORD_BYTES)[0], is_newest)
        self.counts.superseded += max(0, whole - is_newest)

    def sit(self) -> "ControlSession":
        """Take a seat, if it has none yet. Raises DriveError where there is none."""
        if self.seat is None:
            self.seat = self._server.seat_for(self)
        return self.seat

    def give_up_seat(self) -> None:
        """Leave, so that another can sit down now."""
        if self.seat:
            self.seat.leave()
        self._hang_up()

    def _take(self, word: int, is_newest: bool = True) -> None:
        try:
            if self.seat is None or not is_newest:
                self._server.drive.check(word, self.counts)
            if is_newest:
                (self.seat or self.sit()).command(word)
            self._wrong = 0
        except WordError:
            self._wrong += 1
            if self._wrong >= MOST_WRONG:
                self._hang_up()
        except DriveError:
            self._hang_up()

    def _hang_up(self) -> None:
        self._server.drive.turn_away()
        self.drop()


def client_of(transport: asyncio.BaseTransport) -> str:
    """Who is at the other end: the name in its certificate, or its address."""
    address = transport.get_extra_info("peername") or ("?", 0)
    return peer_name(transport.get_extra_info("ssl_object")) or str(address[0])
