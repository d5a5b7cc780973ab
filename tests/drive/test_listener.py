"""A car that ends leaves nobody's connection behind."""

import gc
import socket
import threading
from contextlib import suppress

from support.driven_car import PATIENT, DrivenCar
from support.waiting import DEADLINE_S, wait_until

STARTS, KNOCKS = 8, 5


def knock(port: int, ended: threading.Event, knocks: list[int]) -> None:
    while not ended.is_set():
        with suppress(OSError), socket.create_connection(("127.0.0.1", port), 0.1):
            knocks.append(port)


def test_a_car_that_ends_while_others_come_loses_none_of_their_connections() -> None:
    for _ in range(STARTS):
        ended, knocks = threading.Event(), []
        with DrivenCar(profile=PATIENT) as car:
            ports = (car.port, car.telemetry_port) * 2
            knockers = [threading.Thread(target=knock, args=(port, ended, knocks)) for port in ports]
            for knocker in knockers:
                knocker.start()
            wait_until(lambda knocks=knocks: len(knocks) >= KNOCKS)
        ended.set()
        for knocker in knockers:
            knocker.join(DEADLINE_S)
        # A connection that nobody closed is warned of here, and warnings are errors.
        gc.collect()
