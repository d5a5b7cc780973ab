"""Someone at a terminal in which the command line runs; POSIX alone has such terminals for tests."""

import contextlib
import os
import re
import select
import subprocess
import time

from support.command_line import INSTALLED

# A simulated car's world may have to be compiled first.
DEADLINE_S = 180
# Longer than a key counts as held, and a wish as fresh.
LET_GO_S = 0.7
KITTY_QUERY, WHERE_QUERY = b"\x1b[?u", b"\x1b[6n"


class ControlSession:
    """Someone at a terminal."""

    def __init__(self, handle):
        self.handle = handle
        self.seen = b""
        self.answers_kitty = False

    def look(self, text):
        """Wait until the terminal shows it."""
        end_s = time.monotonic() + DEADLINE_S
        while text not in re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", self.seen.decode("utf-8", "ignore")):
            assert time.monotonic() < end_s, f"never shown: {text}; but {self.seen[-600:]!r}"
            assert self.process.poll() is None or self.glance(), self.seen[-600:]
            self.glance()

    def glance(self):
        """Read what has been written, and answer as a terminal does: whether there was anything."""
        if not select.select([self.handle], [], [], 0.05)[0]:
            return False
        try:
            new = os.read(self.handle, 65536)
        except OSError:
            # The program has ended.
            return False
        self.seen += new
        if self.answers_kitty:
            self.type(b"\x1b[?11u" * new.count(KITTY_QUERY))
        self.type(b"\x1b[1;1R" * new.count(WHERE_QUERY))
        return True

    def type(self, keys):
        os.write(self.handle, keys)

    def hold(self, key, condition):
        """Hold a key, which repeats, until something is so."""
        end_s = time.monotonic() + DEADLINE_S
        while not condition():
            assert time.monotonic() < end_s, "it never happened"
            self.type(key)
            self.glance()

    def press_anew(self, key, condition):
        """Press a key and let go of it for a while, again and again, until something is so."""
        end_s = time.monotonic() + DEADLINE_S
        while not condition():
            assert time.monotonic() < end_s, "it never happened"
            for keys in (key * 3, b""):
                self.type(keys)
                rested_s = time.monotonic() + LET_GO_S
                while time.monotonic() < rested_s and not condition():
                    self.glance()

    def wait(self, condition):
        end_s = time.monotonic() + DEADLINE_S
        while not condition():
            assert time.monotonic() < end_s, "it never happened"
            self.glance()


@contextlib.contextmanager
def seated(*arguments, answers_kitty=False, program=(INSTALLED,)):
    """Someone at a terminal in which the command runs."""
    import pty

    ours, theirs = pty.openpty()
    environment = {**os.environ, "TERM": "xterm-256color", "COLUMNS": "120", "LINES": "30"}
    command = [*program, *map(str, arguments)]
    process = subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, env=environment, close_fds=True)
    os.close(theirs)
    seat = ControlSession(ours)
    seat.answers_kitty = answers_kitty
    seat.process = process
    try:
        yield seat
    finally:
        process.kill()
        process.wait()
        os.close(ours)
