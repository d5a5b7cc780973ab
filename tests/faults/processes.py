"""Pipes and child processes in the simulated room: what `motorcade.drive.motor_guard` takes from the system."""

import io
import subprocess
from collections.abc import Callable, Sequence
from errno import EPIPE
from types import SimpleNamespace
from typing import Any

from greenlet import GreenletExit
from tests.faults.system import THREADS, Replaced, Time
from tests.faults.world import Process, Thread, here, world

_FIRST_PID, _FIRST_HANDLE = 1000, 10
_PIPE_BYTES = 1 << 16
# A process that starts imports for so long before it does anything.
_START_S = 0.15


class Pipe:
    """Bytes from one process to another."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.has_writer = self.has_reader = True
        self.readers: list[Thread] = []

    def wake(self) -> None:
        for thread in self.readers:
            world().wake(thread)


class _End:
    """A file object of a pipe."""

    def __init__(self, handle: int, system: "System") -> None:
        self._handle = handle
        self._system = system

    def fileno(self) -> int:
        return self._handle

    def close(self) -> None:
        self._system.close(self._handle)


class System:
    """Processes by their numbers, and pipes by their handles."""

    def __init__(self, programs: dict[str, Callable[..., object]]) -> None:
        self._programs = programs
        self.pids: dict[int, Process] = {}
        self._pipes: dict[int, tuple[Pipe, bool]] = {}
        self.os = SimpleNamespace(
            getpid=lambda: self.pid_of(here()),
            read=self.read,
            write=self.write,
            kill=lambda pid, signal: self.pids[pid].end(),
            set_blocking=lambda handle, blocks: None,
            name="posix",
        )
        self.subprocess = SimpleNamespace(
            Popen=self._start, PIPE=subprocess.PIPE, TimeoutExpired=subprocess.TimeoutExpired
        )
        self.sys = _Sys(self)

    def pid_of(self, process: Process) -> int:
        """The number of a process."""
        for pid, each in self.pids.items():
            if each is process:
                return pid
        pid = _FIRST_PID + len(self.pids)
        self.pids[pid] = process
        return pid

    def pipe(self, writer: Process, reader: Process) -> tuple[int, int]:
        """A pipe between two processes: the handle to write, and the one to read."""
        pipe, first = Pipe(), _FIRST_HANDLE + len(self._pipes)
        self._pipes |= {first: (pipe, True), first + 1: (pipe, False)}
        writer.at_end.append(lambda: self.close(first))
        reader.at_end.append(lambda: self.close(first + 1))
        return first, first + 1

    def close(self, handle: int) -> None:
        pipe, is_writer = self._pipes[handle]
        if is_writer:
            pipe.has_writer = False
            pipe.wake()
        else:
            pipe.has_reader = False

    def read(self, handle: int, count: int) -> bytes:
        """Wait for bytes; b"" where nobody writes any more."""
        pipe = self._pipes[handle][0]
        world().wait_for(lambda: bool(pipe.data) or not pipe.has_writer, pipe.readers)
        data = bytes(pipe.data[:count])
        del pipe.data[:count]
        return data

    def write(self, handle: int, data: bytes) -> int:
        pipe = self._pipes[handle][0]
        if not pipe.has_reader or not pipe.has_writer:
            raise BrokenPipeError(EPIPE, "Broken pipe")
        if len(pipe.data) + len(data) > _PIPE_BYTES:
            raise BlockingIOError
        pipe.data += data
        pipe.wake()
        return len(data)

    def _start(self, command: Sequence[str], **options: object) -> "Child":
        return Child(self, self._programs[command[2]], command[3:])

    def names(self, module: Any) -> Replaced:
        """What the module takes from the system."""
        return {
            (module, "os"): self.os,
            (module, "subprocess"): self.subprocess,
            (module, "sys"): self.sys,
            (module, "time"): Time,
            (module, "threading"): THREADS,
            # No signal comes from a terminal.
            (module, "signal"): SimpleNamespace(),
        }


class Child:
    """A child process, as `subprocess.Popen` gives it."""

    def __init__(self, system: System, program: Callable[..., object], arguments: Sequence[str]) -> None:
        room, parent = world(), here()
        self.process = Process(room, f"{parent.name}'s guard", parent.lateness_s)
        # The system runs it before other programs.
        self.pid = system.pid_of(self.process)
        writes, reads = system.pipe(parent, self.process)
        answers, hears = system.pipe(self.process, parent)
        self.stdin, self.stdout = _End(writes, system), _End(hears, system)
        self.process.standard = SimpleNamespace(  # type: ignore[attr-defined]
            stdin=SimpleNamespace(buffer=_End(reads, system)), stdout=SimpleNamespace(buffer=_End(answers, system))
        )
        self._waiting: list[Thread] = []
        self.process.at_end.append(self._ended)

        def main() -> None:
            room.sleep(_START_S)
            program(*arguments)
            self.process.end()
            raise GreenletExit

        self.process.start(main)

    def poll(self) -> int | None:
        return 0 if self.process.is_dead else None

    def wait(self, timeout: float | None = None) -> int:
        if not world().wait_for(lambda: self.process.is_dead, self._waiting, timeout):
            raise subprocess.TimeoutExpired("guard", timeout or 0)
        return 0

    def kill(self) -> None:
        self.process.end()

    def _ended(self) -> None:
        for thread in self._waiting:
            world().wake(thread)


class _Sys:
    """`sys`, for a process that knows its own standard input."""

    executable = "python"

    def __init__(self, system: System) -> None:
        self.stderr = io.StringIO()

    @property
    def stdin(self) -> Any:
        return here().standard.stdin  # type: ignore[attr-defined]

    @property
    def stdout(self) -> Any:
        return here().standard.stdout  # type: ignore[attr-defined]
