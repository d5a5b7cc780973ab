"""Drivers that repeat one command, as a working program does, by a mock clock; directly or through bad networks."""

import asyncio
from contextlib import AsyncExitStack, asynccontextmanager, suppress

from motorcade.drive.client import DriveClient
from motorcade.errors import DriveError
from support.fault_proxy import FaultProxy
from support.mock_clock import pass_time

HALF = 0.5


def client(served, **options):
    return DriveClient("127.0.0.1", served.port, telemetry_port=served.telemetry_port, **options)


async def keep(driver, throttle=HALF, steering=0.0):
    """Repeat one command for ever, whatever happens to the connection."""
    while True:
        with suppress(DriveError):
            await driver.drive(throttle, steering)
        await pass_time(0.05)


async def drive_on(driver):
    """Repeat one command until that is an error."""
    while True:
        await driver.drive(HALF)
        await pass_time(0.05)


async def come_and_drive(driver):
    async with driver:
        await drive_on(driver)


@asynccontextmanager
async def driving(driver, *axes):
    task = asyncio.create_task(keep(driver, *axes))
    try:
        yield
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


@asynccontextmanager
async def behind_proxies(car, **options):
    """A client, and the two proxies that it drives through."""
    async with AsyncExitStack() as stack:
        proxies = [await stack.enter_async_context(FaultProxy(port)) for port in (car.port, car.telemetry_port)]
        ports = [proxy.port for proxy in proxies]
        driver = DriveClient("127.0.0.1", ports[0], telemetry_port=ports[1], **options)
        yield await stack.enter_async_context(driver), proxies
