"""Run a car on a computer: its clock, line for uploads, image in a file, voice and watchdog.

`ComputerBoard` is a simulated car without wheels, LEDs and sensors; `motorcade.boards.linux` adds them.
"""

import os
import threading
import time
from binascii import crc32
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from motorcade.boards.lines import TcpPort, WaitingLine
from motorcade.boards.on_chip.parts import SerialVoice
from motorcade.car.board import VOICE_WORDS, Board
from motorcade.car.brain import NO_LED, NO_VOICE
from motorcade.car.loop import Car
from motorcade.config.files import raised_as, read_bytes, replace_file
from motorcade.config.profile import Profile, levels_of
from motorcade.errors import MotorcadeError, Phrase
from motorcade.words.image import parse_image_bytes
from motorcade.words.packing import ImageError
from motorcade.words.request import is_car_name
from motorcade.words.ticks import TICKS_MASK

# Shorter than the shortest time for which a car listens before it relays a word.
TICK_S = 0.004
# Cars that share a thread.
_SHARED_WAIT_S = 0.02
_SHARED_TICK_S = 0.2
# Any byte is a sign of life for a watchdog; V disarms it. Source: the kernel's watchdog-api.
_ALIVE = b"\0"
_DISARM = b"V"
_SUM_BYTES = 4
# Called with what a car's loop reports: kind, time in ms, word, detail (`motorcade.car.board.Board.note`).
Observer = Callable[[str, int, int, int | str], None]


class StoreError(MotorcadeError):
    """A file that can't serve as a car's store; the car can start without it."""


class ImageStore:
    """An image in a file, and the car's name in one beside it. A crash at any moment leaves the old or the new one.

    Behind each stands its CRC-32, four bytes: what was cut or changed on the disk is neither run nor believed.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._name_path = path.with_name(f"{path.name}.name")

    def load(self) -> bytes | None:
        """Return the image's bytes, None where there is no file yet. Raises StoreError."""
        try:
            data = unsealed(read_bytes(self.path))
            parse_image_bytes(data)
        except FileNotFoundError:
            return None
        except OSError as problem:
            raise StoreError("store-unreadable", path=self.path, reason=problem) from None
        except ImageError as problem:
            raise StoreError("store-holds-no-image", path=self.path, reason=problem) from None
        except ValueError:
            raise StoreError("store-holds-no-image", path=self.path, reason=Phrase("store-checksum")) from None
        return data

    def save(self, data: bytes) -> None:
        """Replace the image. Raises OSError; the old image is kept then."""
        self._replace(self.path, data)

    def load_name(self) -> str:
        """Return the name; empty where there is none, or none that a car may have."""
        with suppress(OSError, ValueError):
            name = unsealed(read_bytes(self._name_path)).decode()
            return name if is_car_name(name) else ""
        return ""

    def save_name(self, name: str) -> None:
        """Replace the name. Raises OSError."""
        self._replace(self._name_path, name.encode())

    def _replace(self, path: Path, data: bytes) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(path, sealed(data))


def sealed(data: bytes) -> bytes:
    """Return what an ImageStore writes for ``data``."""
    return data + crc32(data).to_bytes(_SUM_BYTES, "big")


def unsealed(stored: bytes) -> bytes:
    """Return what was stored. Raises ValueError where that was cut or changed."""
    data = stored[:-_SUM_BYTES]
    if sealed(data) != stored:
        raise ValueError("another checksum")
    return data


def keyboard_voice(lines: Iterable[str]) -> SerialVoice:
    """Take the words 'stop' and 'go', or their first letters, from lines that somebody types; ignore any other word.

    Args:
        lines: such as ``sys.stdin``. A thread of its own reads them, since reading a line blocks.
    """
    typed: deque[bytes] = deque()

    def read_lines() -> None:
        typed.extend(f"\n{line.strip().lower()}\n".encode(errors="replace") for line in lines)

    threading.Thread(target=read_lines, daemon=True).start()
    # A line's ends keep a word in it from being taken for the whole.
    patterns = [(f"\n{typed}\n".encode(), voice) for word, voice in VOICE_WORDS for typed in (word, word[0])]
    return SerialVoice(lambda: b"".join([typed.popleft() for _ in range(len(typed))]), patterns)


@dataclass(frozen=True)
class Equipment:
    """The parts that every car on a computer has.

    Attributes:
        is_leader, number, levels: as in `motorcade.car.board.Board`.
        line: where uploads come from.
        image: the stored image, None for none.
        save: stores an image, whole or not at all. Raises OSError.
        voice: returns 'stop' or 'go' that was heard since the last call, as `SerialVoice.heard_voice` does.
        observe: called with what the car's loop reports.
        clock_s: a clock in seconds that never goes back.
        version: of Motorcade.
        name: what the car is called.
        save_name: keeps a new name. Raises OSError.
        battery_mv: returns the battery's voltage, None where nothing measures it. Raises OSError.
    """

    is_leader: bool
    number: int
    levels: tuple[int, ...]
    line: WaitingLine
    image: bytes | None
    save: Callable[[bytes], None] = lambda data: None
    voice: Callable[[], int] = lambda: NO_VOICE
    observe: Observer = lambda *event: None
    clock_s: Callable[[], float] = time.monotonic
    version: str = ""
    name: str = ""
    save_name: Callable[[str], None] = lambda name: None
    battery_mv: Callable[[], int | None] = lambda: None

    def now_ms(self) -> int:
        """Return the clock as a board gives it: milliseconds that wrap at 2^30."""
        return int(self.clock_s() * 1000) & TICKS_MASK


class ComputerBoard(Board):
    """The board of a car without wheels, lights and sensors."""

    kind = "simulated"

    def __init__(self, equipment: Equipment) -> None:
        self.is_leader = equipment.is_leader
        self.number = equipment.number
        self.levels = equipment.levels
        self._equipment = equipment
        self._image = equipment.image
        self.name = equipment.name
        self.version = equipment.version

    @property
    def sender(self) -> int:  # type: ignore[override]
        return self._equipment.line.sender

    def now_ms(self) -> int:
        return self._equipment.now_ms()

    def load_image(self) -> bytes | None:
        return self._image

    def store_image(self, data: bytes) -> None:
        self._equipment.save(data)
        self._image = data

    def read_serial(self) -> bytes:
        return self._equipment.line.read()

    def write_serial(self, data: bytes) -> None:
        self._equipment.line.write(data)

    def answer_requests(self, answer: Callable[[bytes], bytes]) -> bool:
        return self._equipment.line.answer_requests(answer)

    def store_name(self, name: str) -> None:
        self._equipment.save_name(name)
        self.name = name

    def battery_mv(self) -> int | None:
        return self._equipment.battery_mv()

    def heard_voice(self) -> int:
        return self._equipment.voice()

    def note(self, kind: str, at_ms: int, word: int, detail: int | str) -> None:
        self._equipment.observe(kind, at_ms, word, detail)

    def keep_alive(self) -> None:
        """Note that the car's loop runs; called in each of its rounds."""

    def neutral(self) -> None:
        """Stop the wheels and switch the LEDs off."""
        self.set_wheels(0, 0)
        self.set_led(NO_LED)

    def close(self) -> None:
        """Release what the board holds; its outputs are then as at power-on."""


class HardwareWatchdog:
    """The computer's watchdog: without a sign of life it restarts the computer, and pins are then as at power-on.

    Args:
        path: the watchdog's device; it is armed from now on.

    Raises:
        MotorcadeError: it isn't there, another program has it, or this user may not use it.
    """

    def __init__(self, path: Path = Path("/dev/watchdog")) -> None:
        with raised_as("watchdog-unusable", OSError, path=path):
            # A pipe in its place would wait for a reader.
            self._device = os.open(path, os.O_WRONLY | getattr(os, "O_NONBLOCK", 0))

    def keep_alive(self) -> None:
        """Give a sign of life; due again within about 15 s, the kernel's usual limit."""
        os.write(self._device, _ALIVE)

    def close(self) -> None:
        """Disarm it."""
        os.write(self._device, _DISARM)
        os.close(self._device)


class BatteryFile:
    """A battery whose voltage Linux shows in a file.

    Args:
        path: an ``in0_input`` of hwmon (mV) or a ``voltage_now`` of power_supply (µV).

    Raises:
        MotorcadeError: there is no such file.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._per_mv = 1000 if path.name == "voltage_now" else 1
        with raised_as("battery-unreadable", OSError, path=path):
            self.read_mv()

    def read_mv(self) -> int:
        """Return the voltage in mV. Raises OSError."""
        text = read_bytes(self._path).decode("ascii", "replace").strip()
        if not (text.isascii() and text.isdigit() and len(text) < 10):
            raise OSError(str(Phrase("no-voltage", text=text[:20])))
        return int(text) // self._per_mv


def run(board: ComputerBoard, wait: Callable[[float], None], stops: Callable[[], bool]) -> None:
    """Run the car until ``stops()`` is true. Put it in neutral and close it however that ends.

    ``wait`` is called before each tick with the seconds until it, and may return early when bytes have come.
    """
    car = Car(board)
    try:
        while not stops():
            wait(TICK_S)
            car.tick()
            board.keep_alive()
    finally:
        try:
            board.neutral()
        finally:
            board.close()


def run_many(cars: Sequence[tuple[ComputerBoard, TcpPort]], stops: Callable[[], bool]) -> None:
    """Run many simulated cars in this thread until ``stops()`` is true; their ports share the first one's selector.

    A car is ticked when something came for it, and now and then, so a thousand of them keep one processor half idle.
    """
    running = [(Car(board), line) for board, line in cars]
    ticked_s = time.monotonic()
    while not stops():
        running[0][1].wait(_SHARED_WAIT_S)
        is_due = time.monotonic() - ticked_s >= _SHARED_TICK_S
        if is_due:
            ticked_s = time.monotonic()
        for car, line in running:
            if is_due or line.has_come:
                line.has_come = False
                car.tick()


@contextmanager
def simulated_car(line: WaitingLine, store: ImageStore, profile: Profile) -> Iterator[None]:
    """Run a simulated leader in a thread of its own until the block ends. Raises StoreError."""
    board = ComputerBoard(Equipment(True, 0, levels_of(profile), line, store.load(), store.save))
    ended = threading.Event()
    thread = threading.Thread(target=run, args=(board, line.wait, ended.is_set), name="simulated car", daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
