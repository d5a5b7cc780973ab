"""Serve one car at two ports: commands at one, telemetry and requests at the other."""

import asyncio
import socket
import ssl
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

from motorcade.drive.channels import PERIOD_S, CommandChannel, TelemetryChannel
from motorcade.drive.listener import Listener
from motorcade.drive.session import CarControl
from motorcade.drive.tls.revoked import RevokedKeys

_REVOKED_EVERY_S = 0.5


class DriveServer:
    """Make the channels of one car, and find out which of them belong to one client.

    Args:
        control: the car.
        byte_order: of a command, "big" or "little".
        revoked: keys that are refused: a client that shows them is hung up, also one that is connected already.

    Attributes:
        commands: the open connections for commands, the oldest first.
        channels: those for telemetry.
    """

    def __init__(self, control: CarControl, byte_order: str = "big", revoked: RevokedKeys | None = None) -> None:
        self.control = control
        self.revoked = revoked
        self.commands: list[CommandChannel] = []
        self.channels: list[TelemetryChannel] = []
        self._byte_order = byte_order
        self._has_channels = asyncio.Event()

    def command_channel(self, closed: Callable[[], None]) -> CommandChannel:
        """The protocol of a new connection for commands; it calls ``closed`` when the connection is lost."""

        def opened() -> None:
            self.commands.append(channel)
            self._check_keys(channel)

        def lost() -> None:
            self.commands.remove(channel)
            closed()

        channel = CommandChannel(self.control, self._byte_order, opened, lost)
        return channel

    def telemetry_channel(self, closed: Callable[[], None]) -> TelemetryChannel:
        """The protocol of a new connection for telemetry; it calls ``closed`` when the connection is lost."""

        def opened() -> None:
            self.channels.append(channel)
            self._check_keys(channel)
            self._has_channels.set()

        def lost() -> None:
            self.channels.remove(channel)
            closed()

        channel = TelemetryChannel(self.control, self._find, self._count_watchers, opened, lost)
        return channel

    async def send_telemetry(self) -> None:
        """Send telemetry to every channel, ten times a second, until cancelled."""
        loop = asyncio.get_running_loop()
        while True:
            if not self.channels:
                self._has_channels.clear()
                await self._has_channels.wait()
            begin_s = loop.time()
            telemetry = self.control.telemetry()._asdict()
            for channel in list(self.channels):
                channel.end_period(telemetry)
            await asyncio.sleep(max(0.0, begin_s + PERIOD_S - loop.time()))

    async def check_revoked(self) -> None:
        """Look for newly revoked keys twice a second, until cancelled; a list that can't be read is a fault."""
        if self.revoked and self.revoked.problem:
            self.control.fail(self.revoked.problem, stops=False)
        while self.revoked:
            await asyncio.sleep(_REVOKED_EVERY_S)
            # The file may be on a slow card.
            if await asyncio.to_thread(self.revoked.reload):
                if self.revoked.problem:
                    self.control.fail(self.revoked.problem, stops=False)
                channels: list[CommandChannel | TelemetryChannel] = [*self.commands, *self.channels]
                for channel in channels:
                    self._check_keys(channel)

    def _check_keys(self, channel: CommandChannel | TelemetryChannel) -> None:
        if self.revoked and channel.keys_number in self.revoked:
            self.control.turn_away()
            channel.drop()

    def _find(self, channel: TelemetryChannel, by_port: bool) -> CommandChannel | None:
        """The connection for commands of the same client; see `TelemetryChannel`."""
        of_client = [each for each in self.commands if each.client == channel.client]
        if not by_port:
            taken = [each.commands for each in self.channels]
            free = [each for each in of_client if each not in taken]
            return free[0] if len(free) == 1 else None
        found = next((each for each in of_client if each.port == channel.port_named), None)
        for other in self.channels:
            if found and other.commands is found:
                other.commands = None
        return found

    def _count_watchers(self, client: str) -> int:
        return sum(each.watches_alone and each.client == client for each in self.channels)


@asynccontextmanager
async def serving(
    server: DriveServer, commands: socket.socket, telemetry: socket.socket, tls: ssl.SSLContext | None = None
) -> AsyncIterator[tuple[Listener, Listener]]:
    """Accept clients at two listening sockets while the block runs; then drop all of them."""
    turn_away = server.control.turn_away
    listeners = (
        Listener(commands, server.command_channel, turn_away, tls),
        Listener(telemetry, server.telemetry_channel, turn_away, tls),
    )
    tasks = [asyncio.ensure_future(each.serve()) for each in listeners]
    tasks += [asyncio.ensure_future(job()) for job in (server.send_telemetry, server.check_revoked)]
    try:
        yield listeners
    finally:
        for listener in listeners:
            listener.close_to_newcomers()
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        for listener in listeners:
            listener.drop_all()
