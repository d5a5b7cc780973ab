"""The command line in a pseudo-terminal, with a user at it; only POSIX has pseudo-terminals."""

import contextlib
import os
import re
import select
import subprocess
import time

from support.command_line import INSTALLED
from support.waiting import DEADLINE_S

HELD_S = 1.0
# Longer than a key counts as held, and a command as new.
RELEASED_S = 0.7
WHERE_QUERY = b"\x1b[6n"


class TerminalProcess:
    """A user at a terminal in which ``process`` runs."""

    def __init__(self, handle, process):
        self.handle, self.process = handle, process
        self.seen = b""

    def wait_for(self, text):
        """Wait until the terminal shows the text."""
        end_s = time.monotonic() + DEADLINE_S
        while text not in re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", self.seen.decode("utf-8", "ignore")):
            assert time.monotonic() < end_s, f"never shown: {text}; but {self.seen[-600:]!r}"
            assert self.process.poll() is None or self.read(), self.seen[-600:]
            self.read()

    def read(self):
        """Read what the process wrote, and answer as a terminal does. Returns whether there was anything."""
        if not select.select([self.handle], [], [], 0.05)[0]:
            return False
        try:
            new = os.read(self.handle, 65536)
        except OSError:
            # The program has ended.
            return False
        self.seen += new
        self.type(b"\x1b[1;1R" * new.count(WHERE_QUERY))
        return True

    def type(self, keys):
        os.write(self.handle, keys)

    def hold(self, key, condition):
        """Hold a key, which repeats, until a condition holds.

        The key is released now and then: a car whose connection broke on a busy machine waits for that.
        """
        end_s = time.monotonic() + DEADLINE_S
        while not condition():
            assert time.monotonic() < end_s, "it never happened"
            for keys, seconds in ((key, HELD_S), (b"", RELEASED_S)):
                end_of_phase_s = time.monotonic() + seconds
                while time.monotonic() < end_of_phase_s and not condition():
                    self.type(keys)
                    self.read()

    def wait(self, condition):
        """Wait until a condition holds."""
        end_s = time.monotonic() + DEADLINE_S
        while not condition():
            assert time.monotonic() < end_s, "it never happened"
            self.read()


@contextlib.contextmanager
def terminal(*arguments):
    """Run the command in a terminal while the block runs."""
    import pty

    ours, theirs = pty.openpty()
    environment = {**os.environ, "TERM": "xterm-256color", "COLUMNS": "120", "LINES": "30"}
    command = [INSTALLED, *map(str, arguments)]
    process = subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, env=environment, close_fds=True)
    os.close(theirs)
    try:
        yield TerminalProcess(ours, process)
    finally:
        process.kill()
        process.wait()
        os.close(ours)
