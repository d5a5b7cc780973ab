"""Uploads in the simulated room: a car that stores images, computers that send them, and all faults."""

from collections.abc import Callable
from random import Random
from types import SimpleNamespace
from typing import Any

from tests.faults.disk import Disk
from tests.faults.liars import URLS, Opened
from tests.faults.lines import Cable, Damage, SocketPort
from tests.faults.network import Network
from tests.faults.ports import check_ports
from tests.faults.selector import Selector
from tests.faults.system import Replaced, Time, on_disk, replaced
from tests.faults.world import Process, World

from motorcade.boards import lines as car_lines
from motorcade.boards.computer import ComputerBoard, Equipment, ImageStore, StoreError, run, sealed, unsealed
from motorcade.boards.lines import SerialLine, TcpPort
from motorcade.config.profile import built_in_profile, levels_of
from motorcade.errors import MotorcadeError
from motorcade.upload import serial_port
from motorcade.upload.transfer import EITHER, NEW, OLD
from motorcade.words.image import Image, image_words
from motorcade.words.packing import words_to_bytes
from motorcade.words.ticks import TICKS_MASK
from motorcade.words.upload import NO_PROGRAM

_LEVELS = levels_of(built_in_profile("classroom"))
_BAUD = 115200
_MOST_UPLOAD_S = 90.0
_CHANCES = (0.0, 0.0, 0.0, 0.002, 0.02)
_PORT = 7001
# A car that has left off faults takes an upload in so long.
_HEALED_S = 20.0


def drawn_image(random: Random) -> bytes:
    """An image of up to 13 words, or now and then of up to 511."""
    most = 255 if random.random() < 0.04 else 6
    leader = [random.getrandbits(20) << 12 & 0x7FFFFFFF for _ in range(random.randint(0, most))]
    followers = [random.getrandbits(20) << 12 for _ in range(random.randint(0, most))]
    return words_to_bytes(image_words(Image(leader, followers, random.randrange(8), 0)))


class Uploads:
    """One run: a car, its disk and its line, and one or two computers."""

    def __init__(self, room: World) -> None:
        self.world = room
        self.random = random = Random(f"{room.seed} plan")
        self.disk = Disk(room, random, 0.0005)
        self.disk.kill, self.disk.failed = self.end_car, self._failed
        self.folder = self.disk.path("/var")
        self.network = Network(room)
        self.is_tcp = random.random() < 0.5
        self.damages = tuple(
            Damage(*(random.choice(_CHANCES) for _ in range(3))) if random.random() < 0.5 else Damage() for _ in "12"
        )
        for damage in self.damages:
            if random.random() < 0.15:
                damage.dead_from = random.randrange(120)
                damage.dead_until = damage.dead_from + random.choice((random.randrange(60), 1 << 60))
        self.cable = Cable(room, random, self.damages, _BAUD)  # type: ignore[arg-type]
        # All images that anybody has begun to send, and what the car's store may hold.
        self.known: set[bytes | None] = {None}
        self.stored: list[bytes | None] = [None]
        # The image that the car's store writes now.
        self.saving: bytes | None = None
        self.acknowledged: bytes | None = None
        self.active = 0
        self.number = self.left = 0
        self.car: Process | None = None
        self.board: ComputerBoard | None = None
        self.has_lost_power = self.has_failed_late = self.has_port = self.has_rotted = False

    # The disk.

    def _failed(self, what: str) -> None:
        # The one error after which either file may be there.
        self.has_failed_late |= what == "fsync of a folder"
        # What can't be deleted stays.
        self.left += what == "unlink"

    def _check_disk(self) -> None:
        if self.disk.lies:
            return
        for content in self.disk.possible(self.folder / "car" / "car.image"):
            self.world.keep("image-whole", self._read(content) in self.known, "{!r} may be left", content)

    @staticmethod
    def _read(content: bytes | None) -> bytes | None:
        """What the car begins with; None where it says that this is no image of its own, or where there is nothing."""
        return None if content is None else unsealed(content)

    # The car.

    def start_car(self) -> None:
        """Switch the car on."""
        process = self.car = Process(self.world, "car", self.random.choice((0.001, 0.02)))
        process.offset_s = self.random.choice((0.0, (TICKS_MASK - 2000) / 1000, self.random.uniform(0, 1e6)))
        self.world.note("car on")

        def main() -> None:
            store = ImageStore(self.folder / "car" / "car.image")
            try:
                image = store.load()
            except StoreError as problem:
                if problem.code == "store-unreadable":
                    self.end_car(False)
                    self.world.wait()
                # A disk that lies may leave anything; the car says so and starts without a program.
                may_be_damaged = self.has_rotted or (self.disk.lies and self.has_lost_power)
                self.world.keep("image-whole", may_be_damaged, "the store holds no image")
                image = None
            else:
                self.world.keep("fails-closed", not self.has_rotted, "the car begins with a damaged program")
                self._check_start(image)
            self.has_port = False
            line = self._line(process)
            self.has_port = True

            def save(data: bytes) -> None:
                self.stored.append(data)
                self.saving = data
                try:
                    store.save(data)
                finally:
                    self.saving = None

            self.board = ComputerBoard(Equipment(True, 0, _LEVELS, line, image, save, clock_s=Time.monotonic))
            run(self.board, self._waiting(line), lambda: False)

        process.start(main)

    def _check_start(self, image: bytes | None) -> None:
        if self.disk.lies:
            return
        after = self.stored[self.stored.index(self.acknowledged) :] if self.acknowledged else self.stored
        self.world.keep("acknowledged-stays", image in after, "{!r}, acknowledged {!r}", image, self.acknowledged)

    def _line(self, process: Process) -> Any:
        if self.is_tcp:
            line: Any = TcpPort("car", _PORT, Time.monotonic, selector=Selector(self.world))
        else:
            line = SerialLine(self._opened_by_car, Time.monotonic)
        write = line.write

        def written(data: bytes) -> None:
            self._answered(data)
            write(data)

        line.write = written
        return line

    def _opened_by_car(self) -> Any:
        if self.cable.is_pulled and not self.has_port:
            # A car starts with its port.
            self.cable.plug()
        return self.cable.ends[1].open(0.0)

    def _waiting(self, line: Any) -> Callable[[float], None]:
        def wait(seconds: float) -> None:
            # A tick may be late: nothing is due so soon.
            (line if self.is_tcp else self.cable.ends[1]).wait(max(seconds, self.random.choice((0.004, 0.02, 0.05))))

        return wait

    def _answered(self, data: bytes) -> None:
        """The car sends an answer: what it says that it has stored, no kill and no power failure takes away."""
        if b"OK words=" not in data:
            return
        self.world.note("car", data)
        self.acknowledged = self.stored[-1]
        if not self.disk.lies:
            left = {self._read(content) for content in self.disk.possible(self.folder / "car" / "car.image")}
            self.world.keep("acknowledged-stays", left == {self.acknowledged}, "{} may be left", left)

    def holds(self) -> bytes:
        """What the car holds, whether it is on or off."""
        node = self.folder / "car" / "car.image"
        try:
            return unsealed(self.disk.find(node).data)
        except (OSError, ValueError):
            return NO_PROGRAM

    def end_car(self, is_power: bool) -> None:
        """Kill the car's program, or cut its power; it starts again some time later."""
        assert self.car
        if self.car.is_dead:
            return
        self.world.count("kill")
        self.car.end()
        if is_power:
            self.has_lost_power = True
            self.disk.lose_power()
        self.world.after(self.random.choice((0.05, 0.7, 3.0)), self.start_car)

    # The computers.

    def computer(self, number: int) -> None:
        """A computer that uploads, now and then reads back, and in the end finds a healthy car."""
        process = Process(self.world, f"computer {number}", self.random.choice((0.001, 0.03)))
        self.network.link(process.name, 0.001, 0.01)

        def main() -> None:
            self.world.sleep(0.3 + number * self.random.uniform(0, 2))
            for _ in range(self.random.randint(1, 2)):
                self.upload(drawn_image(self.random))
            if number == 0:
                while self.active:
                    self.world.sleep(0.5)
                self.heal()
                last = drawn_image(self.random)
                self.world.keep("goes-on", self.upload(last) == NEW, "no upload to a healthy car")
                self.world.keep("goes-on", serial_port.readback("port", _BAUD) == last, "read back")
                self.rot_and_mend(last)
                check_ports(self.world, self.random)
                self.open_strange_ports(last)
                files = len(self.disk.find(self.folder / "car").entries)
                most = 1 + self.world.counts.get("kill", 0) + self.left
                self.world.keep("no-rubbish", files <= most, f"{files} files, though {most} would be right")
                self.world.is_over = True

        process.start(main)

    def rot(self) -> None:
        """Somebody damages the car's file while the car is off: it says so, and begins with no other program."""
        path, random = self.folder / "car" / "car.image", self.random
        self.world.note("rot")
        for process in [each for each in self.world.processes if each.name == "car" and not each.is_dead]:
            process.end()
        try:
            node = self.disk.find(path)
        except OSError:
            self.start_car()
            return
        good = node.data
        at = random.randrange(max(1, len(good)))
        flipped = good[:at] + bytes([good[at] ^ 1 << random.randrange(8)]) + good[at + 1 :] if good else b"x"
        bad = random.choice((flipped, flipped, good[:at], b"", good + b"\0", b"\0" * len(good)))
        node.data = node.kept = bad
        self.has_rotted = bad != good
        self.start_car()
        self.world.sleep(1.0)
        self.has_rotted = False
        for process in [each for each in self.world.processes if each.name == "car" and not each.is_dead]:
            process.end()
        node = self.disk.find(path)
        node.data = node.kept = good
        self.start_car()
        self.world.sleep(1.0)

    def rot_and_mend(self, image: bytes) -> None:
        """Whatever becomes of a damaged file, a whole one is there afterwards."""
        if self.random.random() < 0.3:
            self.rot()
            self.world.keep("goes-on", serial_port.readback("port", _BAUD) == image, "read back after damage")

    def open_strange_ports(self, image: bytes) -> None:
        """Nobody opens what is neither a device nor a socket, whoever asks."""
        url = self.random.choice(URLS)
        for act in (lambda: serial_port.upload(url, image, _BAUD), lambda: serial_port.readback(url, _BAUD)):
            try:
                act()
            except MotorcadeError as problem:
                self.world.keep("says-why", bool(problem.sentence("zh")), problem.code)
            else:
                self.world.keep("only-ports", False, f"{url} takes an upload")

    def heal(self) -> None:
        """Let all faults end."""
        self.world.note("heal")
        self.world.is_healed = True
        self.disk.heal()
        self.cable.plug()
        self.cable.delay_s = 0.0
        for end in self.cable.ends:
            end.damage = Damage()
        if self.car:
            self.car.frozen_until_s = 0.0
        self.world.sleep(_HEALED_S / 4)

    def upload(self, image: bytes) -> str:
        """Upload an image by the production code; returns what it says that the car holds."""
        self.known.add(image)
        # What was sent may arrive in pieces that make other images, but only if nobody has announced one.
        self.active += 1
        self.number += 1
        number, begin_s, stored = self.number, self.world.now_s, len(self.stored)
        # A car that is slow, or frozen, may still store what an earlier upload sent.
        before = {self.holds(), self.saving or self.holds()}
        is_alone = self.active == 1
        told = ""
        try:
            serial_port.upload("port", image, _BAUD)
            told = NEW
        except MotorcadeError as problem:
            phrase = problem.details.get("holds")
            told = phrase.key.removeprefix("car-holds-") if phrase else ""
            self.world.note("upload fails", problem.code)
        self.active -= 1
        is_alone = is_alone and self.number == number
        self.world.note("upload", told)
        took_s = self.world.now_s - begin_s
        self.world.keep("upload-ends", took_s < _MOST_UPLOAD_S, f"after {took_s:.0f} s")
        if told == NEW:
            self.world.keep("verified", image in self.stored[stored:], "the car never stored it")
        if is_alone and not (self.disk.lies and self.has_lost_power) and not self.has_failed_late:
            holds = self.holds()
            allowed = {NEW: {image}, OLD: before, EITHER: {*before, image}}.get(told)
            if allowed:
                self.world.keep("says-what-it-holds", holds in allowed, "{}, and it holds {!r}", told, holds)
        return told

    # Faults.

    def plan(self) -> None:
        """Draw what goes wrong, and when."""
        random = self.random
        if random.random() < 0.5:
            self.disk.kill_at = random.randrange(1, 40), random.random() < 0.6
        if random.random() < 0.3:
            self.disk.fail_at = {random.randrange(1, 50) for _ in range(random.randint(1, 4))}
        if random.random() < 0.3:
            self.disk.slow_s = random.choice((0.01, 0.3, 1.0))
        if random.random() < 0.1:
            self.disk.lies = True
        if random.random() < 0.3:
            self.disk.free_bytes = random.choice((0, 1, 3, 4, 17))
            self.fault(random.uniform(0, 6), self.disk.fill)
        if random.random() < 0.3:
            self.fault(random.uniform(0, 8), lambda: self._freeze("car"))
        if random.random() < 0.15:
            self.fault(random.uniform(0, 8), lambda: self._freeze("computer 0"))
        if random.random() < 0.4:
            self.fault(random.uniform(0.2, 8), self._break_line)
        if random.random() < 0.25:
            self.fault(random.uniform(0, 8), lambda: self.end_car(random.random() < 0.5))
        if random.random() < 0.2:
            self.cable.delay_s = random.choice((0.05, 0.6, 1.5))

    def fault(self, at_s: float, act: Callable[[], None]) -> None:
        """Let something go wrong at a time, unless all faults have ended."""
        self.world.at(at_s, self.world.unless_healed, act)

    def _freeze(self, name: str) -> None:
        for process in self.world.processes:
            if process.name == name and not process.is_dead:
                self.world.count("freeze")
                process.freeze(self.random.choice((0.1, 0.6, 3.0, 9.0)))

    def _break_line(self) -> None:
        if self.is_tcp:
            link = self.network.links["computer 0"]
            self.random.choice((link.cut, link.forget_one_end, lambda: link.stall(self.random.uniform(0.1, 6))))()
        else:
            self.cable.pull()
            self.world.after(self.random.uniform(0.1, 4), self.cable.plug)

    def begin(self) -> None:
        """Prepare what is there before: perhaps an image, which is kept."""
        self.disk.root.entries["var"] = self.disk.create(self.folder, True)
        if self.random.random() < 0.8:
            image = drawn_image(self.random)
            self.known.add(image)
            self.stored.append(image)
            self.disk.create(self.folder / "car", True)
            self.disk.create(self.folder / "car" / "car.image", False).data = sealed(image)
            self.acknowledged = image
        self.disk.settle()
        self.disk.after = self._check_disk

    def names(self) -> Replaced:
        """What the modules take from the system."""

        def opened(port: str, **options: object) -> Any:
            if self.is_tcp:
                return SocketPort(self.network, "car", _PORT)
            return self.cable.ends[0].open(0.02)

        ports = Opened(opened)
        return on_disk(self.disk) | {
            (serial_port, "serial"): ports,
            (serial_port, "monotonic_ms"): lambda: int(Time.monotonic() * 1000) & TICKS_MASK,
            (serial_port, "secrets"): SimpleNamespace(randbelow=self.random.randrange),
            (car_lines, "listen"): lambda host, port: self.network.listen(self.car, host, port),  # type: ignore[arg-type]
        }


def run_uploads(room: World) -> None:
    """Run the scenario; raises the first promise that is broken."""
    run_ = Uploads(room)
    with replaced(run_.names()):
        run_.begin()
        run_.start_car()
        run_.plan()
        for number in range(1 + (run_.is_tcp and run_.random.random() < 0.5)):
            run_.computer(number)
        room.run(600.0)
        room.keep("goes-on", room.is_over, "the last upload never ended")
