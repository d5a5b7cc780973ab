"""A car of a room in the simulated world: its program, its store, what is promised of it, and how it is found."""

import asyncio
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from random import Random
from types import ModuleType, SimpleNamespace
from typing import Any

from tests.faults.network import Link
from tests.faults.selector import Selector
from tests.faults.system import Time
from tests.faults.uploads import drawn_image
from tests.faults.world import Process

from motorcade.boards.computer import ComputerBoard, Equipment, ImageStore, StoreError, run, sealed, unsealed
from motorcade.boards.lines import TcpPort
from motorcade.config.profile import built_in_profile, levels_of
from motorcade.words.image import Image, image_words
from motorcade.words.packing import words_to_bytes
from motorcade.words.request import GO, STOP, read_request
from motorcade.words.upload import NO_PROGRAM

PORT = 7001
# What a healthy car in a quiet network may take to stand after an order.
STOP_S = 0.3
# A car that is back is reached within 5 s (three heartbeats), and the time to connect.
BACK_S = 8.0
_LEVELS = levels_of(built_in_profile("classroom"))
# A state of 1 s that drives.
_DRIVES = 0x64800000
# A car is ticked so often while nothing comes.
_TICK_S = 0.05


def moving_image(random: Random) -> bytes:
    """A program whose first state drives in most cases, so that a stop shows."""
    if random.random() < 0.3:
        return drawn_image(random)
    return words_to_bytes(image_words(Image([_DRIVES, random.getrandbits(20) << 12 & 0x7FFFFFFF], [], 0, 0)))


class RoomBoard(ComputerBoard):
    """A car whose wheels are watched."""

    car: "RoomCar"

    def set_wheels(self, direction: int, speed_level: int) -> None:
        self.car.set_wheels(speed_level)


class RoomCar:
    """One car: its program, its store, and what is promised of it.

    Attributes:
        host: its address.
        stored: what it has stored, and begun with, the newest last.
        quiet_since_s: since when nothing has disturbed it, its line or its disk.
        failed_late_s: when a disk error left either file.
        ended_s, on_s: when it was switched off, and on.
        was_quiet: whether it was well when it was switched off.
        is_halted: whether it has answered a stop, and no order to go on has been sent since.
        stop_due: when a stop was sent, and until when it has to stand.
        awaits: the last order of the teacher's program, until it has done that.
    """

    def __init__(self, room: Any, number: int) -> None:
        self.room = room
        self.number = number
        self.host, self.port = f"10.0.0.{number + 2}", PORT
        self.folder = room.folder / f"car{number}"
        self.path = self.folder / "car.image"
        first = moving_image(room.random)
        self.known: set[bytes] = {first}
        self.stored: list[bytes] = [first]
        self.stored_s = self.quiet_since_s = 0.0
        self.failed_late_s = self.ended_s = self.on_s = -1.0
        self.name = f"car-{number}"
        self.speed = 0
        self.is_halted = False
        self.awaits = ""
        self.was_quiet = True
        self.stop_due: tuple[float, float] | None = None
        self.process: Process | None = None
        room.disk.create(self.folder, True)
        room.disk.create(self.path, False).data = sealed(first)

    @property
    def link(self) -> Link:
        return self.room.network.links[f"teacher to {self.host}"]

    def disturb(self, seconds: float) -> None:
        """Something goes wrong here for a time."""
        self.quiet_since_s = max(self.quiet_since_s, self.room.world.now_s + seconds)

    def is_quiet(self, since_s: float) -> bool:
        """Whether nothing has disturbed the car or its line since a time, so that promises to healthy cars hold."""
        return (
            max(self.quiet_since_s, self.link.late_until_s) <= since_s
            and self.process is not None
            and not self.process.is_dead
        )

    def holds(self) -> bytes:
        try:
            return unsealed(self.room.disk.find(self.path).data)
        except OSError:
            return NO_PROGRAM

    def start(self) -> None:
        """Switch the car on: it knows nothing of an order."""
        room = self.room
        process = self.process = Process(room.world, f"car {self.number}", room.random.choice((0.001, 0.02)))
        process.offset_s = room.random.uniform(0, 1e6)
        self.is_halted, self.stop_due, self.speed, self.on_s = False, None, 0, room.world.now_s
        room.world.note("on", process.name)

        def main() -> None:
            store = ImageStore(self.path)
            try:
                image = store.load()
            except StoreError:
                # The service manager starts it again.
                self.end()
                room.world.wait()
                raise
            room.world.keep("image-whole", image in self.known, "{} begins {!r}", self.name, image)
            # It may have been switched off just when the image was stored.
            self.stored.append(image)
            line = TcpPort(self.host, PORT, Time.monotonic, selector=Selector(room.world))

            def save(data: bytes) -> None:
                store.save(data)
                self.stored.append(data)
                self.stored_s = room.world.now_s

            equipment = Equipment(True, self.number, _LEVELS, line, image, save, clock_s=Time.monotonic, name=self.name)
            board = RoomBoard(equipment)
            board.car = self
            line.answer_requests = self._noting(line.answer_requests)  # type: ignore[method-assign]
            run(board, lambda seconds: line.wait(max(seconds, _TICK_S)), lambda: False)

        process.start(main)

    def _noting(self, answer_requests: Callable[[Callable[[bytes], bytes]], bool]) -> Callable[..., bool]:
        """Note which orders the car has done."""

        def answer(do: Callable[[bytes], bytes]) -> bool:
            def done(data: bytes) -> bytes:
                answered, request = do(data), read_request(data)
                if request and request.kind in (STOP, GO):
                    if request.kind == self.awaits:
                        self.awaits = ""
                    self.is_halted, self.stop_due = request.kind == STOP, None
                    keeps = request.kind == GO or self.speed == 0
                    self.room.world.keep("stop-gets-through", keeps, f"{self.name} drives, and answers a stop")
                return answered

            return answer_requests(done)

        return answer

    def set_wheels(self, speed: int) -> None:
        self.room.world.note(self.name, "wheels", speed)
        self.room.world.keep("stop-holds", not (self.is_halted and speed), f"{self.name} moves after a stop")
        self.speed = speed

    def end(self) -> None:
        """Kill the car's program; it starts again some time later, or when all faults have ended."""
        if self.process and not self.process.is_dead:
            self.room.world.count("kill")
            self.was_quiet = self.is_quiet(self.room.world.now_s - 2.0)
            off_s = self.room.random.choice((0.1, 1.0, 6.0, 60.0))
            self.disturb(off_s + BACK_S)
            self.process.end()
            self.speed, self.ended_s = 0, self.room.world.now_s
            self.room.world.after(off_s, self.start_again)

    def off_until_s(self) -> float:
        """When the car was switched on again; now where it is off."""
        return self.on_s if self.on_s > self.ended_s else self.room.world.now_s

    def start_again(self) -> None:
        """Switch a car on that is off."""
        if self.process and self.process.is_dead:
            self.start()

    def check(self) -> None:
        """A stop that was sent to a healthy car is done in time."""
        now_s = self.room.world.now_s
        if self.stop_due and now_s > self.stop_due[1]:
            sent_s, due_s = self.stop_due
            is_late = self.is_quiet(sent_s) and self.speed > 0
            self.room.world.keep(
                "stop-gets-through", not is_late, f"{self.name} drives {due_s - sent_s} s after a stop"
            )
            self.stop_due = None


def multicast(places: Sequence[tuple[str, str, int, str]], random: Random) -> dict[str, ModuleType]:
    """`zeroconf`, as far as cars are found by it: it tells what ``places`` has: names, hosts, ports, kinds.

    What has no host was announced without its address, which nobody has.
    """
    announced = {name: place for name, *place in places}

    class CarNetwork:
        def __init__(self, interfaces: object) -> None:
            self.zeroconf = interfaces

        async def async_close(self) -> None:
            pass

    class NetworkBrowser:
        def __init__(self, interfaces: object, service: str, handlers: list[Callable[..., None]]) -> None:
            # Who looks at no interface hears nothing.
            for name in announced if interfaces else ():
                asyncio.get_running_loop().call_later(random.uniform(0.01, 2.0), _tell, handlers[0], name)

        async def async_cancel(self) -> None:
            pass

    def _tell(handler: Callable[..., None], name: str) -> None:
        handler(name=name)

    class Info:
        def __init__(self, service: str, name: str) -> None:
            self._host, self.port, kind = announced[name]
            self.decoded_properties = {"kind": kind, "name": name}

        async def async_request(self, network: object, timeout_ms: int) -> bool:
            await asyncio.sleep(0.01 if self._host else timeout_ms / 1000)
            return bool(self._host)

        def parsed_addresses(self) -> list[str]:
            return [self._host]

    outer, inner = ModuleType("zeroconf"), ModuleType("zeroconf.asyncio")
    outer.InterfaceChoice = SimpleNamespace(All="all")  # type: ignore[attr-defined]
    names: dict[str, Any] = {
        "AsyncServiceBrowser": NetworkBrowser,
        "AsyncServiceInfo": Info,
        "AsyncZeroconf": CarNetwork,
    }
    for name, value in names.items():
        setattr(inner, name, value)
    return {"zeroconf": outer, "zeroconf.asyncio": inner}


@contextmanager
def multicast_of(modules: dict[str, ModuleType]) -> Iterator[None]:
    """Put these modules in the place of others while the block runs."""
    before = {name: sys.modules.get(name) for name in modules}
    sys.modules.update(modules)
    try:
        yield
    finally:
        for name, module in before.items():
            if module is None:
                del sys.modules[name]
            else:
                sys.modules[name] = module
