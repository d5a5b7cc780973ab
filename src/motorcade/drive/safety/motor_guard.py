"""A process of its own that makes the wheels stand still when the one that drives them is killed or frozen.

It has to be told that all is well, again and again, through a pipe that closes with the other process. What it then
calls comes from `motorcade.car.drive_board.DriveBoard.rescue`.
"""

import importlib
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import BinaryIO

_MOVING, _STILL, _BYE = b"m", b"s", b"q"
# Windows ends a process by any signal that it can't deliver.
_KILL = getattr(signal, "SIGKILL", signal.SIGTERM)
_TRIES = 200
_TRY_EVERY_S = 0.005
# What killing a process and reaching its pins may take; the wheels have to stand by the end of the patience.
_RESCUE_S = 0.05
_GOODBYE_S = 5.0


class MotorGuard:
    """The end in the process that drives.

    Args:
        rescue: what makes the wheels stand still: ``"module:function"`` and its arguments.
        patience_ms: so long after the last word moving wheels stand still; over 100.
    """

    def __init__(self, rescue: tuple[str, Sequence[str]], patience_ms: int) -> None:
        call, arguments = rescue
        own = [str(os.getpid()), str(patience_ms), call, *arguments]
        self._process = subprocess.Popen(
            [sys.executable, "-m", "motorcade.drive.safety.motor_guard", *own],
            stdin=subprocess.PIPE,
            # Ctrl-C and Ctrl-Z in a terminal are not for the one that has to see to their outcome.
            start_new_session=True,
        )
        if os.name == "posix":
            # A guard that hangs mustn't hold up the wheels, and is as good as gone.
            assert self._process.stdin
            os.set_blocking(self._process.stdin.fileno(), False)

    def beat(self, moves: bool) -> None:
        """All is well; ``moves``: the wheels turn. Raises OSError where the guard is gone."""
        self._tell(_MOVING if moves else _STILL)

    def dismiss(self) -> None:
        """The wheels stand still by now: the guard ends without doing anything."""
        with suppress(OSError):
            self._tell(_BYE)
        assert self._process.stdin
        self._process.stdin.close()
        try:
            self._process.wait(_GOODBYE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _tell(self, word: bytes) -> None:
        assert self._process.stdin
        try:
            os.write(self._process.stdin.fileno(), word)
        except OSError:
            raise OSError("the process that guards the wheels is gone: serve the car anew") from None


class _Watch:
    """What the guard has heard; its reader is a thread, since no system but POSIX can wait for a pipe and a clock."""

    def __init__(self, pipe: BinaryIO) -> None:
        self.last = _STILL
        self.has_ended = False
        self.heard = threading.Event()
        self._pipe = pipe
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        while said := os.read(self._pipe.fileno(), 64):
            self.last = said[-1:]
            self.heard.set()
        self.has_ended = True
        self.heard.set()

    def outcome(self, patience_s: float) -> str:
        """Waits until something is wrong: ``dismissed``, ``killed`` or ``frozen``."""
        while True:
            # Twice, as the first wait may have been over while this process itself was not running.
            is_heard = self.heard.wait(0.8 * patience_s) or self.heard.wait(0.2 * patience_s)
            self.heard.clear()
            if self.has_ended:
                return "dismissed" if self.last == _BYE else "killed"
            if not is_heard and self.last == _MOVING:
                return "frozen"


def _rescue(rescue: Callable[..., None], arguments: Sequence[str]) -> bool:
    """Call it until it works: the pins of a process are free only a while after its end."""
    pause = threading.Event()
    for _ in range(_TRIES):
        try:
            rescue(*arguments)
        except Exception as problem:  # noqa: BLE001 - nothing is a reason not to try again
            print(f"motorcade: the wheels may still turn: {problem}", file=sys.stderr)
            pause.wait(_TRY_EVERY_S)
        else:
            return True
    return False


def main(pid: str, patience_ms: str, call: str, *arguments: str) -> int:
    """Guard the process ``pid``; 0 where it ended well, 1 where the wheels had to be stopped, 2 where they weren't."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    module, _, function = call.partition(":")
    rescue = getattr(importlib.import_module(module), function)
    outcome = _Watch(sys.stdin.buffer).outcome(int(patience_ms) / 1000 - _RESCUE_S)
    if outcome == "dismissed":
        return 0
    if outcome == "frozen":
        # It holds the pins, and would go on with old commands when it thaws.
        with suppress(OSError):
            os.kill(int(pid), _KILL)
    print(f"motorcade: the car's server was {outcome}; the wheels are being stopped", file=sys.stderr)
    return 1 if _rescue(rescue, arguments) else 2


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
