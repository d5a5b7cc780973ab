"""How commands end, and what those that hold a car's hardware share.

SIGTERM, SIGHUP (a terminal that is closed, ssh that breaks off) and Windows' Ctrl-Break end every command as Ctrl-C
does, so that it leaves ports, boards and terminals in order. A command that holds a car's hardware is told by
`Ending` instead, in one way for all signals, and ends with still wheels.

A terminal may take no output for any time (Ctrl-S, a frozen ssh window), and so may a pipe that nobody reads. A loop
that prints would wait there, and a car does meanwhile what it did last. So while hardware is held, what anything
prints, warnings of libraries too, goes into a queue, and a thread waits for the terminal.
"""

import io
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from queue import SimpleQueue
from types import FrameType
from typing import Any, TextIO

from motorcade.cli.output import print_note, translated

_ENDS = ("SIGTERM", "SIGHUP", "SIGBREAK")
# So many lines wait for a terminal; the next ones are counted and not shown.
_MOST_LINES = 1000
_LAST_LINES_S = 1.0

_Handler = Callable[[int, FrameType | None], Any]


@contextmanager
def _handling(handler: _Handler, names: Iterable[str]) -> Iterator[None]:
    """Call ``handler`` for signals while the block runs, where the system has them."""
    numbers = [getattr(signal, name) for name in names if hasattr(signal, name)]
    # nohup ignores SIGHUP so that the command goes on. A shell's jobs in the background ignore SIGINT, which is no
    # reason for a car to ignore it.
    handled = [number for number in numbers if number == signal.SIGINT or signal.getsignal(number) != signal.SIG_IGN]
    is_main = threading.current_thread() is threading.main_thread()
    before = {}
    if is_main:
        before = {number: signal.signal(number, handler) for number in handled}
    try:
        yield
    finally:
        for number, former in before.items():
            signal.signal(number, former)


@contextmanager
def ending_as_by_ctrl_c() -> Iterator[list[int]]:
    """Make all signals that end a command do what Ctrl-C does while the block runs; gives the others that came."""
    came: list[int] = []

    def end(number: int, frame: FrameType | None) -> None:
        came.append(number)
        if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
            raise KeyboardInterrupt
        # asyncio and uvicorn have handlers of their own for it.
        signal.raise_signal(signal.SIGINT)

    with _handling(end, _ENDS):
        yield came


class Ending:
    """Whether a signal has asked a command to end."""

    def __init__(self) -> None:
        self.is_due = False
        self._then: Callable[[], object] = lambda: None

    def then(self, call: Callable[[], object]) -> None:
        """Call something when a signal comes; at once where one has come."""
        self._then = call
        if self.is_due:
            call()

    def end(self, number: int, frame: FrameType | None) -> None:
        """Take a signal."""
        self.is_due = True
        self._then()


@contextmanager
def holding_hardware() -> Iterator[Ending]:
    """Let signals end a command in order, and no output hold it up, while the block runs."""
    ending = Ending()
    with _handling(ending.end, (*_ENDS, "SIGINT")), _queued("stdout"), _queued("stderr"):
        yield ending


@contextmanager
def _queued(name: str) -> Iterator[None]:
    """Let a thread write what is printed to a stream of `sys` while the block runs; then wait for a second at most."""
    stream = getattr(sys, name)
    if stream is None:
        yield
        return
    queued = _QueuedStream(stream)
    setattr(sys, name, queued)
    try:
        yield
    finally:
        setattr(sys, name, stream)
        queued.finish()


class _QueuedStream(io.TextIOBase):
    """A text stream whose lines a thread writes to another one."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._line = ""
        # Python prints in the middle of a print, where it finalizes objects then: neither may wait for the other.
        self._lock = threading.RLock()
        self._lines: SimpleQueue[str | None] = SimpleQueue()
        self._lost = 0
        self._thread = threading.Thread(target=self._write_lines, name="output", daemon=True)
        self._thread.start()

    @property
    def encoding(self) -> str:  # type: ignore[override]
        return self._stream.encoding or "utf-8"

    def isatty(self) -> bool:
        return self._stream.isatty()

    def fileno(self) -> int:
        return self._stream.fileno()

    def writable(self) -> bool:
        return True

    def write(self, text: str) -> int:
        with self._lock:
            *lines, self._line = (self._line + text).split("\n")
            for line in lines:
                self._put(f"{line}\n")
        return len(text)

    def finish(self) -> None:
        """Write what waits, for at most a second."""
        with self._lock:
            self._put(self._line)
        self._lines.put(None)
        self._thread.join(_LAST_LINES_S)

    def _put(self, line: str) -> None:
        if self._lines.qsize() < _MOST_LINES:
            self._lines.put(line)
        else:
            self._lost += 1

    def _write_lines(self) -> None:
        write = _writer_to(self._stream)
        while (line := self._lines.get()) is not None:
            try:
                write(line)
            except BrokenPipeError:
                # Nobody reads any more, and nobody will: the car drives on.
                write = _ignore
            except OSError:
                self._lost += 1
                continue
            with self._lock:
                lost, self._lost = self._lost, 0
            if lost:
                print_note(translated("lines-lost", count=lost))


def _ignore(line: str) -> None:
    pass


def _writer_to(stream: TextIO) -> Callable[[str], None]:
    """Return what writes text to the file of a stream, without the stream's lock: whoever holds that may never return.

    Python asks for the lock when it ends, and would hang or crash.
    """
    try:
        # In use until the process ends.
        file = open(os.dup(stream.fileno()), "wb", buffering=0)  # noqa: PTH123, SIM115
    except (OSError, ValueError):
        # A test's stream has no file.
        def write_text(line: str) -> None:
            stream.write(line)
            stream.flush()

        return write_text

    def write(line: str) -> None:
        data = line.encode(stream.encoding or "utf-8", stream.errors or "replace")
        while data:
            data = data[file.write(data) :]

    return write
