"""A driver's end for programs that don't use asyncio."""

import asyncio
import threading
from collections.abc import Callable, Coroutine
from functools import wraps
from operator import attrgetter
from typing import Any, Self, TypeVar

from motorcade.drive.client import DriveClient

_Result = TypeVar("_Result")


def _blocking(method: Callable[..., Coroutine[Any, Any, _Result]]) -> Callable[..., _Result]:
    """A method of `DriveClient` that the calling thread waits for."""

    @wraps(method)
    def wait(self: "BlockingDriveClient", *arguments: Any, **options: Any) -> _Result:
        return self._wait(method(self._client, *arguments, **options))

    return wait


class BlockingDriveClient:
    """Drive a car over the network: ``with BlockingDriveClient("192.168.1.20") as car: ...``.

    It takes the arguments of `DriveClient`, and its attributes and methods are those of `DriveClient`. The connection
    lives in a thread of its own. It repeats a command only while the command is fresh, so the car stops soon when the
    program hangs.
    """

    def __init__(self, host: str, *arguments: Any, **options: Any) -> None:
        self._client = DriveClient(host, *arguments, **options)
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name="drive client", daemon=True)

    def __enter__(self) -> Self:
        """Connect. Raises CarError where that fails."""
        self._thread.start()
        try:
            self._wait(self._client.__aenter__())
        except BaseException:
            self._end()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        """Stop the car and hang up."""
        try:
            self._wait(self._client.end())
        finally:
            self._end()

    telemetry, you, connected, waits_for_release = (
        property(attrgetter(f"_client.{name}")) for name in ("telemetry", "you", "connected", "waits_for_release")
    )
    drive = _blocking(DriveClient.drive)
    drive_for = _blocking(DriveClient.drive_for)
    next_telemetry = _blocking(DriveClient.next_telemetry)
    request = _blocking(DriveClient.request)
    release = _blocking(DriveClient.release)
    stop = _blocking(DriveClient.stop)
    clear = _blocking(DriveClient.clear)
    resume_program = _blocking(DriveClient.resume_program)

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_forever()
        self._loop.close()

    def _wait(self, work: Coroutine[Any, Any, _Result]) -> _Result:
        waiting = asyncio.run_coroutine_threadsafe(work, self._loop)
        try:
            return waiting.result()
        except BaseException:
            # Ctrl-C ends the wait, and has to end the work too.
            waiting.cancel()
            raise

    def _end(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
