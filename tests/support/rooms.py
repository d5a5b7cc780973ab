"""Simulated cars at ports of this computer, and servers that are no cars, for tests of many cars."""

import asyncio
import selectors
import threading
from collections.abc import AsyncIterator, Callable, Coroutine, Iterator
from contextlib import asynccontextmanager, closing, contextmanager
from functools import wraps
from typing import Any

from motorcade.boards.computer import ComputerBoard, Equipment, run_many
from motorcade.boards.lines import TcpPort
from motorcade.config.profile import levels_of
from support.pseudo_terminal import PseudoTerminal
from support.strategies import CLASSROOM

# A state of 1 s and one of 2 s; another program of one state.
FIRST = bytes.fromhex("02000000 64800000 6D000000")
SECOND = bytes.fromhex("01000000 40280000")
FIRST_CRC32, SECOND_CRC32 = "8215339d", "04c29092"


def in_loop(test: Callable[..., Coroutine[Any, Any, None]]) -> Callable[..., None]:
    """Run a test in an event loop with the real time, since its cars are threads and sockets."""
    return wraps(test)(lambda *arguments, **options: asyncio.run(test(*arguments, **options)))


class SimulatedCar(ComputerBoard):
    """A car whose test sees its wheels, its LED and its states."""

    def __init__(self, number: int, line: TcpPort | PseudoTerminal, **more: object) -> None:
        self.wheels, self.leds = (0, 0), [4]
        self.states: list[object] = []
        self.named = f"car-{number}"
        keeps = {"name": self.named, "image": FIRST, "save_name": self._keep, "observe": self._observe} | more
        super().__init__(Equipment(True, number, levels_of(CLASSROOM), line, **keeps))  # type: ignore[arg-type]
        self.address = line.address.removeprefix("socket://")

    @property
    def image(self) -> bytes:
        return self._image or b""

    def set_wheels(self, direction: int, speed_level: int) -> None:
        self.wheels = (direction, speed_level)

    def set_led(self, which: int) -> None:
        self.leds.append(which)

    def _keep(self, name: str) -> None:
        self.named = name

    def _observe(self, kind: str, at_ms: int, word: int, detail: object) -> None:
        if kind == "state":
            self.states.append(detail)


@contextmanager
def simulated_cars(count: int, port: int = 0, **more: object) -> Iterator[list[SimulatedCar]]:
    """Run cars in a thread while the block runs; ``more`` is of their equipment, or of their ports (tls, refuses)."""
    selector = selectors.DefaultSelector()
    of_ports = {key: more.pop(key) for key in ("tls", "refuses") if key in more}
    lines = [TcpPort("127.0.0.1", port, selector=selector, **of_ports) for _ in range(count)]  # type: ignore[arg-type]
    cars = [SimulatedCar(number, line, **more) for number, line in enumerate(lines)]
    ended = threading.Event()
    thread = threading.Thread(target=run_many, args=(list(zip(cars, lines, strict=True)), ended.is_set))
    thread.start()
    try:
        yield cars
    finally:
        ended.set()
        thread.join()
        for line in lines:
            line.close()


@asynccontextmanager
async def server(answer: bytes) -> AsyncIterator[str]:
    """Serve a port that gives ``answer`` to whatever comes, while the block runs; yields its address."""

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        # Also where this task is cancelled because all ends.
        with closing(writer):
            while await reader.read(4096):
                writer.write(answer)

    listener = await asyncio.start_server(serve, "127.0.0.1", 0)
    async with listener:
        host, port = listener.sockets[0].getsockname()[:2]
        yield f"{host}:{port}"
