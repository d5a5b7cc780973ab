"""The car's end of a serial line, a pseudo-terminal or TCP, that a test plays."""

import contextlib
import io
import itertools
import os
import select
import socket
import threading

from motorcade.words.request import CHECK_BYTES, check_words, ready_line
from support.upload_ends import read_check
from support.waiting import DEADLINE_S

# One state: forward at 200 mm/s for 1 s.
IMAGE = bytes.fromhex("01000000 64800000")
OLD = bytes.fromhex("01000000 6D000000")


class OverError(Exception):
    """The test is over, and nobody talks to the car any more."""


class PlayedCar:
    """The car's end of a line, played by a test, or by a script beside it."""

    def __init__(self, kind):
        self._ends: list[io.RawIOBase] = []
        self._scripts: list[threading.Thread] = []
        self._over, self._ending = socket.socketpair()
        if kind == "pty":
            import pty
            import tty

            end, self.client = pty.openpty()
            tty.setraw(self.client)
            self._ends += [os.fdopen(end, "r+b", buffering=0), os.fdopen(self.client, "r+b", buffering=0)]
            self.port = os.ttyname(self.client)
        else:
            self._listener = socket.create_server(("127.0.0.1", 0))
            self.port = f"socket://127.0.0.1:{self._listener.getsockname()[1]}"

    def _wait_for(self, end, why):
        ready = select.select([end, self._over], [], [], DEADLINE_S)[0]
        if self._over in ready:
            raise OverError
        assert ready, why

    def _end(self):
        if not self._ends:
            self._wait_for(self._listener, "nobody came")
            client, _ = self._listener.accept()
            with client, self._listener:
                self._ends.append(client.makefile("rwb", buffering=0))
        return self._ends[0]

    def receive(self, count):
        data = b""
        while len(data) < count:
            self._wait_for(self._end(), f"only {len(data)} bytes came")
            came = self._end().read(count - len(data))
            if not came:
                raise OverError
            data += came
        return data

    def send(self, data):
        self._end().write(data)

    def hang_up(self):
        self._end().close()

    def play(self, script):
        def acted():
            # The play is over, too, when the uploader has hung up.
            with contextlib.suppress(OverError, ValueError, ConnectionError):
                script()

        self._scripts.append(threading.Thread(target=acted))
        self._scripts[-1].start()

    def answer(self, answer, to):
        """Answer whatever of the length of ``to`` comes."""

        def script():
            while True:
                self.receive(len(to))
                self.send(answer)

        self.play(script)

    def take(self, *answers, image=IMAGE):
        """Be a car that knows checks and holds OLD: answer what it is sent with each of ``answers``, then the last."""

        def script():
            for count in itertools.count():
                self.get_ready()
                self.receive(len(image))
                self.send(answers[min(count, len(answers) - 1)])

        self.play(script)

    def get_ready(self):
        check = read_check(self.receive(CHECK_BYTES))
        assert check, "it came damaged"
        self.send(ready_line(check_words(*check), OLD))

    def close(self):
        self._ending.close()
        for script in self._scripts:
            script.join(DEADLINE_S)
        for end in self._ends:
            end.close()
        self._over.close()
