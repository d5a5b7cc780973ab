"""An ESP32's car with Wi-Fi and keys at a port of this computer, by real sockets and real TLS.

MicroPython's Unix build and CPython run it. It reads a line of JSON: the port, the keys and the levels of the profile.
It prints a line for each piece of a handshake, with how many ms it took, the wheels' speed and
the highest before, and ends with its input.
"""

import json
import select
import socket
import sys
import time

try:
    import tls
except ImportError:
    from simulated import tls

from motorcade.boards.on_chip.secure_line import Keys, SecureLine
from motorcade.boards.on_chip.wifi_line import Announcer
from motorcade.car.board import Board
from motorcade.car.loop import Car

# A program of two states, both of which drive.
DRIVES = b"\x02\0\0\0\x64\x80\0\0\x6d\0\0\0"


class ChipCable:
    """A cable that a test may speak through."""

    def __init__(self):
        self.came, self.answered = b"", b""

    def read(self):
        came, self.came = self.came, b""
        return came

    def write(self, data):
        self.answered += data

    def close(self):
        pass


class ChipStation:
    """The chip's connection to its network; without an address that hasn't come yet, so the car isn't announced."""

    def __init__(self, address=None):
        self._address = address

    def isconnected(self):
        return self._address is not None

    def ifconfig(self):
        return self._address


class ChipClock:
    """MicroPython's module time, where CPython lacks it."""

    def ticks_ms(self):
        return int(time.time() * 1000) & 0x3FFFFFFF


class ChipBoard(Board):
    """A slow chip's board at a line."""

    is_leader, kind, name = True, "esp32", "ada"
    words_a_tick, bytes_a_tick = 4, 64

    def __init__(self, line, levels):
        self.line, self.levels, self.image = line, levels, DRIVES
        self.speed = self.fastest = 0

    @property
    def sender(self):
        return self.line.sender

    def now_ms(self):
        return ChipClock().ticks_ms()

    def load_image(self):
        return self.image

    def store_image(self, data):
        self.image = data

    def read_serial(self):
        return self.line.read()

    def write_serial(self, data):
        self.line.write(data)

    def answer_requests(self, answer):
        return self.line.answer_requests(answer)

    def needs_rest(self):
        return self.line.needs_rest()

    def work_at_rest(self):
        begin_ms = self.now_ms()
        self.line.work_at_rest()
        print("rest", self.now_ms() - begin_ms, self.speed, self.fastest)

    def set_wheels(self, direction, speed_level):
        self.speed = speed_level
        self.fastest = max(self.fastest, speed_level)


def main(port, keys, levels):
    announcer = Announcer(ChipStation(), socket, ChipClock(), "0000002a")
    line = SecureLine(Keys(tls, keys), ChipCable(), socket, select, ChipClock(), announcer, port)
    car = Car(ChipBoard(line, tuple(levels)))
    poll = select.poll()
    poll.register(sys.stdin, select.POLLIN | select.POLLHUP)
    print("ready", sys.implementation.name)
    while not poll.poll(1):
        car.tick()
    line.close()


if __name__ == "__main__":
    main(*json.loads(sys.stdin.readline()))
