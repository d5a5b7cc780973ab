"""The pages of the studio and of the remote, as their servers meet them: WebSockets spoken in JSON."""

import json
import time

from support.waiting import DEADLINE_S


class PageSocket:
    """The WebSocket of a page."""

    def __init__(self, socket):
        self._socket = socket

    def send(self, do, **values):
        self._socket.send_text(json.dumps({"do": do} | values))

    def until(self, kind, holds=lambda message: True):
        """The next message of a kind for which something holds; pictures are acknowledged, as the page does."""
        end_s = time.monotonic() + DEADLINE_S
        while True:
            assert time.monotonic() < end_s, f"no {kind} as it is awaited came within {DEADLINE_S} s"
            received = self._socket.receive()
            if received.get("bytes"):
                self.look(received["bytes"])
                if kind == "picture":
                    return {}
                continue
            message = json.loads(received["text"])
            if message["is"] == kind and holds(message):
                return message

    def look(self, picture):
        """A picture came."""


class RemotePage(PageSocket):
    """The remote's page."""

    def car(self, name, holds=lambda car: True):
        """The telemetry of a car when something holds of it."""
        told = self.until("telemetry", lambda told: name in told["cars"] and holds(told["cars"][name]))
        return told["cars"][name]

    def drive(self, *cars, throttle=1.0):
        """Moves the stick, and waits until the server has heard of it."""
        self.send("drive", cars=cars, throttle=throttle, steering=0.0)
        self.until("received")

    def push(self, *cars, throttle=1.0):
        """Arms the cars and holds the stick until all of them move."""
        self.drive(*cars, throttle=0.0)
        self.drive(*cars, throttle=throttle)
        while not all(car["state"] == "moving" for car in self._all(cars)):
            self.drive(*cars, throttle=0.0)
            self.drive(*cars, throttle=throttle)

    def _all(self, cars):
        told = self.until("telemetry", lambda told: set(cars) <= set(told["cars"]))["cars"]
        return [told[name] for name in cars]
