"""A replacement for the modules network, socket and select of an ESP32 in a room with Wi-Fi. Portable.

lwIP and the radio run beside the program, on the other core; a call of theirs passes a message to that and back. Nobody
measured how long that takes with MicroPython; CALL_US is several times the time of a semaphore between two cores.
"""

from simulated.timing import time_methods

CALL_US = 100
ADDRESS = "192.168.1.77"


class Wifi:
    """The chip's network: a client can connect, send and read."""

    STA_IF = 0
    AF_INET, SOCK_DGRAM, SOL_SOCKET, SO_REUSEADDR = 2, 2, 1, 4
    POLLIN = 1

    def __init__(self, chip):
        self.chip = chip
        self.announced = []
        self.listener = None
        self._client = None
        time_methods(chip, self, "socket")

    def modules(self):
        """Return the modules as `motorcade.boards.on_chip.power_on.Modules` has them."""
        return (self, self, self, None)

    def arrive(self, data):
        """Let a client send ``data``, after it has connected if it hasn't yet."""
        if self._client is None:
            self._client = Socket(self)
            self.listener.waiting.append(self._client)
        self._client.came += data

    # The module network

    def hostname(self, name):
        pass

    def WLAN(self, kind):  # noqa: N802 - MicroPython's name
        return self

    def active(self, on):
        pass

    def connect(self, name, password):
        pass

    def isconnected(self):
        return True

    def ifconfig(self):
        return (ADDRESS, "255.255.255.0", "", "")

    # The modules socket and select

    def socket(self, family=AF_INET, kind=1):
        return Socket(self)

    def getaddrinfo(self, host, port):
        return [(self.AF_INET, 1, 0, "", (host, port))]

    def poll(self):
        return Poll(self.chip)


class Socket:
    """A socket of the chip: the listener, a client's connection, or one that sends announcements."""

    def __init__(self, wifi):
        self._wifi = wifi
        self.waiting = []
        self.came = b""
        time_methods(wifi.chip, self, "accept", "recv", "send", "sendto")

    def setsockopt(self, level, option, value):
        pass

    def bind(self, address):
        pass

    def listen(self, count):
        self._wifi.listener = self

    def setblocking(self, waits):
        pass

    def fileno(self):
        return -1

    def close(self):
        pass

    def accept(self):
        self._wifi.chip.pass_time(CALL_US)
        return self.waiting.pop(0), (ADDRESS, 1)

    def recv(self, size):
        self._wifi.chip.pass_time(CALL_US)
        data, self.came = self.came[:size], self.came[size:]
        return data

    def send(self, data):
        self._wifi.chip.pass_time(CALL_US)
        self._wifi.chip.notify("bytes", None, bytes(data))
        return len(data)

    def sendto(self, data, address):
        self._wifi.chip.pass_time(CALL_US)
        self._wifi.announced.append(data)


class Poll:
    """A select.poll of sockets."""

    def __init__(self, chip):
        self._sockets = []
        time_methods(chip, self, "poll")

    def register(self, socket, events):
        self._sockets.append(socket)

    def unregister(self, socket):
        self._sockets.remove(socket)

    def poll(self, timeout_ms):
        return [(each, 1) for each in self._sockets if each.waiting or each.came]
