"""A driver's end for programs that don't use asyncio."""

import asyncio
import threading
from collections.abc import Callable, Coroutine
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Self, TypeVar

from motorcade.drive.client import DriveClient
from motorcade.drive.wire import Telemetry

_Result = TypeVar("_Result")


class BlockingDriveClient:
    """Drive a car over the network: ``with BlockingDriveClient("192.168.1.20") as car: ...``.

    It takes the arguments of `DriveClient`, and its attributes and methods are those of `DriveClient`. The connection
    lives in a thread of its own. It repeats a command only while the command is fresh, so the car stops soon when the
    program hangs.
    """

    def __init__(self, host: str, *arguments: Any, **options: Any) -> None:
        self._client = DriveClient(host, *arguments, **options)
        self._loop = asyncio.new_event_loop()
        self._ended = asyncio.Event()
        self._thread = threading.Thread(target=self._run, name="drive client", daemon=True)

    def __enter__(self) -> Self:
        """Connect. Raises DriveError where that fails."""
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

    @property
    def telemetry(self) -> Telemetry | None:
        return self._client.telemetry

    @property
    def you(self) -> dict[str, Any]:
        return self._client.you

    @property
    def connected(self) -> bool:
        return self._client.connected

    @property
    def waits_for_release(self) -> bool:
        return self._client.waits_for_release

    def drive(self, throttle: float = 0.0, steering: float = 0.0, **switches: int) -> None:
        self._wait(self._client.drive(throttle, steering, **switches))

    def drive_for(self, seconds: float, throttle: float = 0.0, steering: float = 0.0, **switches: int) -> None:
        self._wait(self._client.drive_for(seconds, throttle, steering, **switches))

    def next_telemetry(self) -> Telemetry:
        return self._wait(self._client.next_telemetry())

    def request(self) -> bool:
        return self._wait(self._client.request())

    def release(self) -> None:
        self._wait(self._client.release())

    def stop(self) -> None:
        self._wait(self._client.stop())

    def clear(self) -> None:
        self._wait(self._client.clear())

    def resume_program(self) -> None:
        self._wait(self._client.resume_program())

    def _run(self) -> None:
        # A runner ends what is still under way, such as a connection that nobody answers.
        with asyncio.Runner(loop_factory=lambda: self._loop) as runner:
            self._loop.set_default_executor(_DaemonThreads())
            runner.run(self._ended.wait())

    def _wait(self, work: Coroutine[Any, Any, _Result]) -> _Result:
        waiting = asyncio.run_coroutine_threadsafe(work, self._loop)
        try:
            return waiting.result()
        except BaseException:
            # Ctrl-C ends the wait, and has to end the work too.
            waiting.cancel()
            raise

    def _end(self) -> None:
        self._loop.call_soon_threadsafe(self._ended.set)
        self._thread.join()


class _DaemonThreads(ThreadPoolExecutor):
    """Run each call in a thread of its own, for which nobody waits: to look a name up may take half a minute."""

    def submit(self, call: Callable[..., _Result], /, *arguments: Any, **options: Any) -> "Future[_Result]":
        future: Future[_Result] = Future()
        # A call that has begun can't be cancelled: its result comes, also where nobody waits any more.
        future.set_running_or_notify_cancel()

        def run() -> None:
            try:
                future.set_result(call(*arguments, **options))
            except BaseException as problem:  # noqa: BLE001 - whoever waits for the future gets it
                future.set_exception(problem)

        threading.Thread(target=run, daemon=True).start()
        return future
