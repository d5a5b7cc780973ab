"""Stop the wheels from another process when the one that drives them is killed or frozen.

The driving process reports again and again that all is well, and for how long the command counts that moves the wheels,
through a pipe that closes when it ends. What the guard then calls comes from
`motorcade.car.drive_board.DriveBoard.rescue`. The guard answers each report, so that the driving process stops the
wheels where the guard is frozen.
"""

import importlib
import os
import signal
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import BinaryIO

from motorcade.errors import MotorcadeError, Phrase
from motorcade.locales import catalogue, system_language

# A report is a number: one of these, or for how many more ms the command that moves the wheels counts, above them.
_END, _STILL, _MOVING = range(3)
_REPORT = struct.Struct(">H")
_MOST_MS = (1 << 16) - 1 - _MOVING
_ANSWER = b"a"
_START_S = 10.0
# Windows ends a process by any signal that it can't deliver.
_KILL = getattr(signal, "SIGKILL", signal.SIGTERM)
_TRIES = 200
_TRY_EVERY_S = 0.005
# Time for a busy computer to run the guard, to kill a process and to reach its pins: the wheels have to stand still
# when the patience is over.
_RESCUE_S = 0.1
# A process that is so much late with the stop at the end of a command is frozen.
_GRACE_S = 0.02
# A guard that runs so much later than it wanted was frozen too, and reads first what came meanwhile.
_LATE_S = 0.05
_PRIORITY = 5
_END_S = 5.0


class MotorGuard:
    """Start the guard, and report to it; the end in the process that drives.

    Args:
        rescue: what stops the wheels: ``"module:function"`` and its arguments.
        patience_ms: moving wheels stand still so long after the last report, or 30 ms after the end of the command that
            the report names; over 100. A guard that answers nothing for half of it counts as frozen.

    Returns when the guard is ready; raises OSError where it isn't within 10 s.
    """

    def __init__(self, rescue: tuple[str, Sequence[str]], patience_ms: int) -> None:
        call, arguments = rescue
        own = [str(os.getpid()), str(patience_ms), call, *arguments]
        self._process = subprocess.Popen(
            [sys.executable, "-m", "motorcade.drive.motor_guard", *own],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            # So that Ctrl-C and Ctrl-Z in a terminal don't reach the guard.
            start_new_session=True,
        )
        assert self._process.stdin
        assert self._process.stdout
        self._reports = self._process.stdin
        self._answers = self._process.stdout
        if os.name == "posix":
            # A guard that hangs counts as gone, and mustn't block this process.
            os.set_blocking(self._reports.fileno(), False)
        self._answer_s = patience_ms / 2000
        # When the oldest report was sent that has no answer.
        self._asked_s: float | None = None
        self._has_answered = False
        self._is_ready = threading.Event()
        self._reader = threading.Thread(target=self._read, name="motor guard's answers", daemon=True)
        self._reader.start()
        self._is_ready.wait(_START_S)
        if not self._has_answered:
            self.dismiss()
            raise _gone()

    def beat(self, moves: bool, rest_ms: int | None = None) -> None:
        """Report that all is well. Raises OSError where the guard is gone or frozen.

        Args:
            moves: whether the wheels may turn.
            rest_ms: for how much longer the command counts that moves them; None where none does.
        """
        now_s = time.monotonic()
        asked_s = self._asked_s
        if asked_s is None:
            self._asked_s = now_s
        elif now_s - asked_s > self._answer_s:
            raise _gone()
        report = _STILL
        if moves:
            report = _MOVING
        if moves and rest_ms is not None:
            report += 1 + min(max(rest_ms, 0), _MOST_MS - 1)
        self._write(report)

    def dismiss(self) -> None:
        """End the guard without a rescue; the wheels stand still already."""
        with suppress(OSError):
            self._write(_END)
        self._reports.close()
        try:
            self._process.wait(_END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._reader.join()
        self._answers.close()

    def _read(self) -> None:
        while os.read(self._answers.fileno(), 64):
            self._asked_s = None
            self._has_answered = True
            self._is_ready.set()
        # It has ended.
        self._is_ready.set()

    def _write(self, report: int) -> None:
        try:
            os.write(self._reports.fileno(), _REPORT.pack(report))
        except OSError:
            raise _gone() from None


def _gone() -> OSError:
    return OSError(str(MotorcadeError("motor-guard-gone")))


class _PipeReader:
    """The guard's ends of the pipes, in a thread: only POSIX systems can wait for a pipe with a timeout."""

    def __init__(self, pipe: BinaryIO, answers: BinaryIO) -> None:
        self._last = _STILL
        self._answers = answers
        self._has_ended = False
        self._has_report = threading.Event()
        self._pipe = pipe
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        self._answer()
        while reports := os.read(self._pipe.fileno(), 64):
            (self._last,) = _REPORT.unpack(reports[-_REPORT.size :])
            self._has_report.set()
            self._answer()
        self._has_ended = True
        self._has_report.set()

    def _answer(self) -> None:
        # A process that has ended, or is frozen, reads no answer.
        with suppress(OSError):
            os.write(self._answers.fileno(), _ANSWER)

    def outcome(self, patience_s: float) -> str:
        """Wait until the other process is "dismissed", "killed" or "frozen"."""
        while True:
            last = self._last
            if last <= _MOVING:
                wait_s = patience_s
            else:
                wait_s = min(patience_s, (last - _MOVING - 1) / 1000 + _GRACE_S)
            due_s = time.monotonic() + wait_s
            has_report = self._has_report.wait(wait_s)
            if not has_report and time.monotonic() > due_s + _LATE_S:
                has_report = self._has_report.wait(_LATE_S)
            self._has_report.clear()
            if self._has_ended:
                if self._last == _END:
                    return "dismissed"
                return "killed"
            if not has_report and self._last >= _MOVING:
                return "frozen"


def _rescue(rescue: Callable[..., None], arguments: Sequence[str]) -> Exception | None:
    """Call ``rescue`` until it works: the pins of a process are free only some time after its end.

    Returns why it never did. Prints nothing, since whoever reads may be stuck.
    """
    pause = threading.Event()
    last = None
    for _ in range(_TRIES):
        try:
            rescue(*arguments)
        except Exception as problem:  # noqa: BLE001 - try again whatever the reason
            last = problem
            pause.wait(_TRY_EVERY_S)
        else:
            return None
    return last


def hurry() -> None:
    """Run this thread before other programs, where the system lets this user do that."""
    with suppress(AttributeError, OSError):
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(_PRIORITY))
        return
    with suppress(AttributeError, OSError):
        os.nice(-_PRIORITY)


def main(pid: str, patience_ms: str, call: str, *arguments: str) -> int:
    """Guard the process ``pid``.

    Returns:
        0 where it ended well, 1 where the wheels had to be stopped, 2 where that failed.
    """
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    module, _, function = call.partition(":")
    rescue = getattr(importlib.import_module(module), function)
    # This process doesn't know what --language is; after the death of that one there is no time for reading files.
    language = system_language()
    catalogue(language)
    hurry()
    # The rest of the patience is for a busy computer, and for the rescue.
    waiting_s = int(patience_ms) / 1000 - min(_RESCUE_S, int(patience_ms) / 3000)
    outcome = _PipeReader(sys.stdin.buffer, sys.stdout.buffer).outcome(waiting_s)
    if outcome == "dismissed":
        return 0
    if outcome == "frozen":
        # It holds the pins, and would execute old commands when it goes on.
        with suppress(OSError):
            os.kill(int(pid), _KILL)
    problem = _rescue(rescue, arguments)
    phrases = [Phrase(f"guard-server-{outcome}")]
    if problem:
        phrases.append(Phrase("guard-wheels-may-turn", reason=problem))
    for phrase in phrases:
        print(f"motorcade: {phrase.sentence(language)}", file=sys.stderr)
    if problem:
        return 2
    return 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
