"""A car's two doors: commands at one port, telemetry and requests at the other."""

import asyncio
import socket
import ssl
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

from motorcade.config.profile import Profile
from motorcade.drive.command_channel import CommandChannel
from motorcade.drive.drive_failures import DriveError
from motorcade.drive.listener import ClientProtocol, Listener
from motorcade.drive.session import CarControl, ControlSession
from motorcade.drive.telemetry_channel import PERIOD_S, TelemetryChannel

BYTE_ORDERS = ("big", "little")


class DriveServer:
    """What the connections to one car share.

    Args:
        drive: the car.
        profile: its kind.
        byte_order: of a command, ``big`` or ``little``.

    Attributes:
        commands: the connections for commands that are open.
        channels: those for telemetry.
    """

    def __init__(self, drive: CarControl, profile: Profile, byte_order: str = "big") -> None:
        self.drive = drive
        self.commands: list[CommandChannel] = []
        self.channels: list[TelemetryChannel] = []
        self._hand_over_ms = profile.drive.hand_over_ms
        self._byte_order = byte_order
        self._is_heard = asyncio.Event()

    def command_channel(self, left: Callable[[ClientProtocol], None]) -> CommandChannel:
        """The protocol of a new connection for commands."""
        return CommandChannel(left, self, self._byte_order)

    def telemetry_channel(self, left: Callable[[ClientProtocol], None]) -> TelemetryChannel:
        """The protocol of a new connection for telemetry."""
        return TelemetryChannel(left, self)

    def seat_for(self, channel: CommandChannel) -> ControlSession:
        """A seat for who sends commands, if need be that of the one who has been silent for longest.

        Only who has been silent for as long as loses a driver the wheel gives it up. Raises DriveError.
        """
        try:
            return self.drive.join(channel.name, counts=channel.counts)
        except DriveError:
            silences = [(self.drive.silent_ms(each.seat), each) for each in self.commands if each.seat]
            longest_ms, longest = max(silences, key=lambda silence: silence[0], default=(0, None))
            if longest is None or longest_ms <= self._hand_over_ms:
                raise
            longest.give_up_seat()
            return self.drive.join(channel.name, counts=channel.counts)

    def named_by(self, channel: TelemetryChannel) -> CommandChannel | None:
        """The connection for commands of the same client at the port that the channel names."""
        for found in self.commands:
            if found.client == channel.client and found.port == channel.port_named:
                for other in self.channels:
                    if other.commands is found:
                        other.commands = None
                return found
        return None

    def alone_like(self, channel: TelemetryChannel) -> CommandChannel | None:
        """The connection for commands of the same client that has no channel, where there is one and no more."""
        taken = [each.commands for each in self.channels]
        alike = [each for each in self.commands if each.client == channel.client and each not in taken]
        return alike[0] if len(alike) == 1 else None

    def hear(self, channel: TelemetryChannel) -> None:
        """A connection for telemetry is open."""
        self.channels.append(channel)
        self._is_heard.set()

    async def tell(self) -> None:
        """Send telemetry to every channel until cancelled."""
        loop = asyncio.get_running_loop()
        while True:
            if not self.channels:
                self._is_heard.clear()
                await self._is_heard.wait()
            begin_s = loop.time()
            told = self.drive.telemetry()._asdict()
            for channel in list(self.channels):
                channel.tell(told)
            await asyncio.sleep(max(0.0, begin_s + PERIOD_S - loop.time()))


@asynccontextmanager
async def served(
    server: DriveServer, commands: socket.socket, telemetry: socket.socket, tls: ssl.SSLContext | None = None
) -> AsyncIterator[tuple[Listener, Listener]]:
    """Let clients in at two listening sockets while the block runs; then everybody is dropped."""
    turn_away = server.drive.turn_away
    doors = (
        Listener(commands, server.command_channel, turn_away, tls),
        Listener(telemetry, server.telemetry_channel, turn_away, tls),
    )
    tasks = [asyncio.ensure_future(each) for each in (doors[0].serve(), doors[1].serve(), server.tell())]
    try:
        yield doors
    finally:
        for door in doors:
            door.shut()
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
