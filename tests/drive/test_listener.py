"""A listener gives open connections a turn, and leaves nobody's connection behind when it ends."""

import asyncio
import contextlib
import gc
import socket
import threading
from collections.abc import Callable
from contextlib import suppress
from functools import partial

from motorcade.drive.listener import Listener, bind
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


class Standing(asyncio.Protocol):
    """A client that stays."""

    holder = ""
    stays = False

    def __init__(self, closed: Callable[[], None]) -> None:
        self._closed = closed

    def connection_lost(self, exc: Exception | None) -> None:
        self._closed()

    def has_session(self) -> bool:
        return True

    def drop(self) -> None:
        pass


class Answering(Standing):
    """Notes of the connection whether what is sent in two parts is held back until the first part is acknowledged."""

    def __init__(self, is_prompt: asyncio.Future[int], closed: Callable[[], None]) -> None:
        super().__init__(closed)
        self._is_prompt = is_prompt

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        line = transport.get_extra_info("socket")
        self._is_prompt.set_result(line.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))


def test_the_end_of_an_answer_does_not_wait_for_its_beginning_to_be_acknowledged() -> None:
    async def accept() -> int:
        is_prompt = asyncio.get_running_loop().create_future()
        with bind("127.0.0.1", 0) as socket_of_listener:
            listener = Listener(socket_of_listener, partial(Answering, is_prompt), lambda: None)
            serving = asyncio.ensure_future(listener.serve())
            with socket.create_connection(listener.address):
                async with asyncio.timeout(DEADLINE_S):
                    prompt = await is_prompt
            listener.close_to_newcomers()
            serving.cancel()
            await asyncio.gather(serving, return_exceptions=True)
        return prompt

    assert asyncio.run(accept())


def test_open_connections_get_a_turn_between_two_newcomers() -> None:
    turns, turn_of_each = 0, []

    async def accept() -> None:
        loop, all_came = asyncio.get_running_loop(), asyncio.Event()

        def count_turn() -> None:
            nonlocal turns
            turns += 1
            loop.call_soon(count_turn)

        def accepted(closed) -> Standing:
            turn_of_each.append(turns)
            if len(turn_of_each) == 12:
                all_came.set()
            return Standing(closed)

        with bind("127.0.0.1", 0) as socket_of_listener, contextlib.ExitStack() as held:
            listener = Listener(socket_of_listener, accepted, lambda: None)
            for _ in range(12):
                held.enter_context(socket.create_connection(listener.address))
            count_turn()
            serving = asyncio.ensure_future(listener.serve())
            async with asyncio.timeout(DEADLINE_S):
                await all_came.wait()
            listener.close_to_newcomers()
            serving.cancel()
            await asyncio.gather(serving, return_exceptions=True)

    asyncio.run(accept())
    assert len(set(turn_of_each)) == len(turn_of_each)
