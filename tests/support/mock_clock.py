"""An event loop with a clock of its own: when nothing is left to do, its time jumps to the next timer.

Sockets stay real, so a test proves the real protocol; only waiting takes no time, however busy the machine is.
"""

import asyncio
import functools
import selectors
from collections.abc import Callable
from concurrent.futures import Executor
from typing import TypeVar, TypeVarTuple

from support.waiting import DEADLINE_S

_Arguments = TypeVarTuple("_Arguments")
_Answer = TypeVar("_Answer")
# So long a loop waits for the sockets of this computer before its time jumps.
_IDLE_S = 0.001
# A test in which nothing happens any more fails after this real time.
_STUCK_S = DEADLINE_S
# Not 0, so that times before the test are distinguished from 'never'.
_BEGIN_S = 1000.0


class MockClockLoop(asyncio.SelectorEventLoop):
    """Its ``time()`` begins at 1000 s and goes on only by jumps to the next timer."""

    def __init__(self) -> None:
        self._now_s = _BEGIN_S
        self._jobs = 0
        super().__init__(_JumpingSelector(self))

    def time(self) -> float:
        return self._now_s

    def jump(self, seconds: float) -> bool:
        """Let time pass, unless a thread works for the loop. Returns whether it did."""
        if self._jobs:
            return False
        self._now_s += seconds
        return True

    def run_in_executor(
        self, executor: Executor | None, func: Callable[[*_Arguments], _Answer], *args: *_Arguments
    ) -> asyncio.Future[_Answer]:
        self._jobs += 1
        future = super().run_in_executor(executor, func, *args)
        future.add_done_callback(self._end_job)
        return future

    def _end_job(self, future) -> None:
        self._jobs -= 1


class _JumpingSelector(selectors.DefaultSelector):
    def __init__(self, loop: MockClockLoop) -> None:
        super().__init__()
        self._loop = loop

    def select(self, timeout=None):
        if timeout is None:
            events = super().select(_STUCK_S)
            assert events, "nothing happens any more"
            return events
        if timeout <= 0:
            return super().select(0)
        events = super().select(_IDLE_S)
        if not events and not self._loop.jump(timeout):
            events = super().select(_IDLE_S)
        return events


async def pass_time(seconds: float) -> None:
    """Let so much time of the mock clock pass. It fails in a loop with the real clock, because no test sleeps."""
    assert isinstance(asyncio.get_running_loop(), MockClockLoop), "this loop has the real clock"
    await asyncio.sleep(seconds)


def mock_clock(test):
    """Run an ``async def`` test in a loop with a mock clock."""

    @functools.wraps(test)
    def run(*arguments, **options):
        with asyncio.Runner(loop_factory=MockClockLoop) as runner:
            runner.run(test(*arguments, **options))

    return run
