"""The pages of the studio and of the remote, as their servers meet them: WebSockets spoken in JSON."""

import json
import time

from starlette.websockets import WebSocketDisconnect

from support.pictures import Picture
from support.waiting import DEADLINE_S


class PageSocket:
    """The WebSocket of a page: what comes is read in order, messages by kind."""

    def __init__(self, socket):
        self._socket = socket

    def send(self, do: str, **values) -> None:
        self._socket.send_text(json.dumps({"do": do} | values))

    def next(self):
        """The kind of what comes next, and its values."""
        message = self._socket.receive()
        if message["type"] == "websocket.close":
            raise WebSocketDisconnect(message["code"])
        if message.get("bytes"):
            return "picture", Picture(message["bytes"])
        values = json.loads(message["text"])
        return values.pop("is"), values

    def until(self, kind: str, holds=lambda values: True):
        """The next of a kind for which something holds; pictures are acknowledged, as the page does."""
        end_s = time.monotonic() + DEADLINE_S
        while True:
            assert time.monotonic() < end_s, f"no {kind} as it is awaited came within {DEADLINE_S} s"
            what, values = self.next()
            if what == "picture":
                self.send("shown", frame=values.number)
            if what == kind and holds(values):
                return values


class RemotePage(PageSocket):
    """The remote's page."""

    def car(self, name, holds=lambda car: True):
        """The telemetry of a car when something holds of it."""
        told = self.until("telemetry", lambda told: name in told["cars"] and holds(told["cars"][name]))
        return told["cars"][name]

    def drive(self, *cars, throttle=1.0, steering=0.0, **more):
        """Moves the stick, and waits until the server has heard of it."""
        self.send("drive", cars=cars, throttle=throttle, steering=steering, **more)
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
