"""Serve one car at two ports: commands at one, telemetry and requests at the other."""

import asyncio
import socket
import ssl
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial

from motorcade.drive.channels import PERIOD_S, Clients, CommandChannel, TelemetryChannel
from motorcade.drive.listener import Listener

_REVOKED_EVERY_S = 0.5


async def _send_telemetry(clients: Clients) -> None:
    """Send telemetry to every channel, ten times a second, until cancelled."""
    loop = asyncio.get_running_loop()
    while True:
        if not clients.channels:
            clients.has_channels.clear()
            await clients.has_channels.wait()
        begin_s = loop.time()
        telemetry = clients.control.telemetry()._asdict()
        for channel in list(clients.channels):
            channel.end_period(telemetry)
        await asyncio.sleep(max(0.0, begin_s + PERIOD_S - loop.time()))


async def _check_revoked(clients: Clients) -> None:
    """Look for newly revoked keys twice a second, until cancelled; a list that can't be read is a fault."""
    control, revoked = clients.control, clients.revoked
    if revoked and revoked.problem:
        control.fail(revoked.problem, stops=False)
    while revoked:
        await asyncio.sleep(_REVOKED_EVERY_S)
        # The file may be on a slow card.
        if await asyncio.to_thread(revoked.reload):
            if revoked.problem:
                control.fail(revoked.problem, stops=False)
            for channel in [*clients.commands, *clients.channels]:
                channel.check_keys()


@asynccontextmanager
async def serving(
    clients: Clients, commands: socket.socket, telemetry: socket.socket, tls: ssl.SSLContext | None = None
) -> AsyncIterator[tuple[Listener, Listener]]:
    """Accept clients at two listening sockets while the block runs; then drop all of them."""

    def turn_away() -> None:
        clients.control.turned_away += 1

    listeners = (
        Listener(commands, partial(CommandChannel, clients), turn_away, tls),
        Listener(telemetry, partial(TelemetryChannel, clients), turn_away, tls),
    )
    tasks = [asyncio.ensure_future(each.serve()) for each in listeners]
    tasks += [asyncio.ensure_future(job(clients)) for job in (_send_telemetry, _check_revoked)]
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
