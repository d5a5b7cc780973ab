"""A class in the simulated room: its server and folder, a teacher, four pupils, a stranger, and all faults."""

import asyncio
import atexit
import hashlib
from collections.abc import Callable
from errno import ENOENT
from functools import cache
from pathlib import Path
from random import Random
from shutil import rmtree
from tempfile import mkdtemp
from types import SimpleNamespace
from typing import Any

import uvicorn
from tests.faults.disk import Disk, DiskPath
from tests.faults.loop import SimulatedLoop, check_connections, watch_memory
from tests.faults.network import Network, Socket
from tests.faults.pupils import PASSWORD, ClassStranger, PupilMember, TeacherMember
from tests.faults.system import Replaced, in_threads, on_disk, replaced
from tests.faults.world import Faults, Lock, Process, World

from motorcade.classroom import folder as class_folder
from motorcade.classroom import names as class_names
from motorcade.classroom import running as class_running
from motorcade.classroom.app import make_class_app
from motorcade.classroom.folder import LIMITS, RECORD, ClassFolder
from motorcade.classroom.network import Network as ClassNetwork
from motorcade.classroom.record import from_bytes, new_record, to_bytes
from motorcade.classroom.running import ClassServerSettings
from motorcade.errors import MotorcadeError
from motorcade.server.fleet import RemoteCar
from motorcade.server.running import serving
from motorcade.server.studio import workers
from motorcade.service.requests import respond

_PORT = 7710
_FAULTS_S = 4.0
# As docs/security.md has them: of an address, four times as many for a moment; and in all.
_MOST_OF_AN_ADDRESS, _MOST_CONNECTIONS = 32 * 4 + 4, 512 + 4
_MOST_WAITING_BYTES = 1 << 20
# What the calendar of the class's computer shows at the beginning, in s since 1970.
EPOCH_S = 1_790_000_000.0
# Of numbers from so many one in so many is drawn again: a class never sees that two pupils have one by chance.
_LARGE, _AGAIN = 1000, 0.3
# uvicorn looks ten times a second whether its server is to end; here nothing but the end of a program depends on it.
_LOOK_S = 1.0
# The files of a built page, by their addresses.
FILES = {
    **{f"{name}.html": f"<title>{name}</title>" for name in ("index", "class", "drive")},
    "assets/code-1.js": "// " + 500 * "code ",
}
# A password whose check takes no time: its cost is stored with it.
_SALT = b"salt of the test"
STORED = f"scrypt:2:{_SALT.hex()}:{hashlib.scrypt(PASSWORD.encode(), salt=_SALT, n=2, r=8, p=1).hex()}"


@cache
def page_folder() -> Path:
    """The folder of a built page, once for all runs."""
    folder = Path(mkdtemp(prefix="motorcade-"))
    atexit.register(rmtree, folder, ignore_errors=True)
    for name, text in FILES.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    return folder


async def _seldom_look(server: uvicorn.Server) -> None:
    """Do what `uvicorn.Server.main_loop` does, in fewer rounds."""
    while not await server.on_tick(0):
        await asyncio.sleep(_LOOK_S)


class ClassComputer:
    """The computer of a class: its disk, its network and its server, which is started again whenever it ends.

    Attributes:
        wall_s: so far its calendar is from its clock: somebody may set it.
        started_s: when the server was started last.
        cars: the real cars that pupils may drive.
        limits: how much an owner may store.
        hosts: its addresses.
        record: takes what pages do with cars.
    """

    def __init__(self, room: World) -> None:
        self.world = room
        self.random = random = Random(f"{room.seed} plan")
        self.disk = Disk(room, random, 0.0002)
        self.disk.kill, self.disk.spared = self.kill, ("iterdir", "read", "fsync of a folder")
        self.folder = self.disk.path("/class")
        self.network = Network(room)
        self.network.watch = self._connected
        self.server: Process | None = None
        self.loop: SimulatedLoop | None = None
        self.code = ""
        self._calm_s = self.wall_s = self.started_s = 0.0
        self.cars: tuple[RemoteCar, ...] = ()
        self.limits = LIMITS
        self.hosts = ["192.168.1.5", "10.0.0.9", "fd00::5"]
        self.first_key: str | None = None
        self.record: Callable[[str, str, str], None] | None = None

    def is_calm(self) -> bool:
        """Whether the server has run undisturbed for a while, whatever its disk does."""
        now_s = self.world.now_s
        return self.server is not None and not self.server.is_dead and now_s > self._calm_s

    def disturb(self, seconds: float) -> None:
        self._calm_s = max(self._calm_s, self.world.now_s + seconds + 1.0)

    def stored_pupil(self, name: str) -> Any:
        """The pupil of that name in the class's file, as the teacher could tell."""
        record = from_bytes(self.disk.find(self.folder / RECORD).data, RECORD)
        return next((each for each in record.pupils if each.name == name), None)

    def _connected(self, name: str, port: int, socket: Socket) -> None:
        check_connections(self.network, socket, _MOST_OF_AN_ADDRESS, _MOST_CONNECTIONS)

    # The disk.

    def _check_disk(self) -> None:
        for content in self.disk.possible(self.folder / RECORD):
            is_whole = content is not None and content.startswith(b"{") and content.endswith(b"}\n")
            self.world.keep("class-whole", is_whole, "{!r} may be left", content)

    def _remove_tree(self, path: DiskPath) -> None:
        if not path.exists():
            raise FileNotFoundError(ENOENT, "No such file", str(path))
        for child in list(path.iterdir()):
            if child.is_dir():
                self._remove_tree(child)
            else:
                child.unlink()
        path.rmdir()

    # The server.

    def supervise(self) -> None:
        """Start the server, and again some time after it has ended."""
        if self.server is None or self.server.is_dead:
            self._start()
        self.world.after(self.random.uniform(0.2, 0.8), self.supervise)

    def _start(self) -> None:
        process = self.server = Process(self.world, "server", self.random.choice((0.001, 0.005)))
        self.disturb(0.5)
        self.started_s = self.world.now_s
        self.world.note("server starts")
        loop = self.loop = SimulatedLoop(process, self.network)

        async def serve() -> None:
            here = ClassNetwork(self.hosts, _PORT)
            times = {"clock": loop.time, "unix_s": lambda: EPOCH_S + loop.time() + self.wall_s}
            files = ClassFolder(self.folder, self.limits)
            try:
                settings = ClassServerSettings(
                    library=self.folder,  # type: ignore[arg-type]
                    page=page_folder(),
                    port=_PORT,
                    network=here,
                    cars=self.cars,
                    first_key=self.first_key,
                    record=self.record,
                    **times,  # type: ignore[arg-type]
                )
                app = make_class_app(settings, files)
            except MotorcadeError as problem:
                self.refused(problem)
                process.end()
                return
            listener: Any = self.network.listen(process, "server", _PORT)
            async with serving(app, settings, listener):
                await asyncio.Event().wait()

        loop.run(serve)

    def refused(self, problem: MotorcadeError) -> None:
        """The server doesn't start."""
        self.world.keep("class-whole", problem.code == "unreadable-file", problem)

    def kill(self, is_power: bool) -> None:
        """Kill the server, or cut the computer's power."""
        if self.server is None or self.server.is_dead:
            return
        self.world.count("kill")
        self.disturb(2.0)
        self.server.end()
        if is_power:
            self.disk.lose_power()

    def begin(self, stored: str = STORED) -> None:
        """Prepare the folder of a class whose teacher has a password, unless none is ``stored``."""
        record = new_record(self.random.randrange)
        record.password = stored or None
        self.code = record.code
        self.disk.create(self.folder, True)
        self.disk.create(self.folder / RECORD, False).data = to_bytes(record)
        self.disk.settle()
        self.disk.after = self._check_disk

    def names(self) -> Replaced:
        random = self.random
        drawn = [0]

        def below(most: int) -> int:
            """Draw as chance may: the same number again."""
            if most < _LARGE or random.random() > _AGAIN:
                drawn[0] = random.randrange(most)
            return drawn[0] % most

        def answered(name: str, data: bytes, context: Any, most_s: float, given_up: Any) -> bytes:
            return respond(name, data, context)

        return (
            on_disk(self.disk)
            | in_threads()
            | {
                (class_folder, "Lock"): Lock,
                (class_folder, "shutil"): SimpleNamespace(rmtree=self._remove_tree),
                (class_running, "secrets"): SimpleNamespace(
                    randbelow=below, token_urlsafe=lambda count: random.randbytes(count).hex()
                ),
                (class_names, "_COST"): 2,
                (workers, "answer_in_process"): answered,
                # No process is started ahead.
                (workers, "_waiting"): [None],
                (uvicorn.Config, "configure_logging"): lambda config: None,
                (uvicorn.Server, "main_loop"): _seldom_look,
            }
        )


class Class(ClassComputer):
    """One run: the computer, its members, and what goes wrong."""

    def __init__(self, room: World) -> None:
        super().__init__(room)
        random = self.random
        self.has_checked: set[int] = set()
        self.teacher = TeacherMember(self)
        self.pupils = [PupilMember(self, number) for number in range(4)]
        self.strangers = [ClassStranger(self, f"stranger {number}") for number in range(2) if random.random() < 0.15]
        for member in (self.teacher, *self.pupils, *self.strangers):
            self.network.link(member.name, random.choice((0.002, 0.01)), random.choice((0.0, 0.01)))

    # Faults.

    def plan(self) -> None:
        """Draw what goes wrong, and when."""
        random = self.random
        links = [self.network.links[each.name] for each in (*self.pupils[1:], self.teacher)]
        if random.random() < 0.4:
            self.disk.kill_at = random.randrange(20, 400), random.random() < 0.6
        if random.random() < 0.25:
            self.disk.fail_at = {random.randrange(20, 500) for _ in range(random.randint(1, 5))}
        if random.random() < 0.25:
            self.disk.slow_s = random.choice((0.005, 0.05, 0.2))
        self.disk.free_bytes = random.choice((0, 1, 30, 200))
        acts: Faults = [
            (0.35, self._fill),
            (0.25, lambda: self.kill(random.random() < 0.5)),
            (0.15, self._freeze),
            (0.4, lambda: random.choice(links[:3]).stall(random.choice((0.3, 1.5, 4.0)))),
            (0.3, lambda: random.choice(links[:3]).cut()),
            (0.2, lambda: random.choice(links[:3]).forget_one_end()),
            (0.2, lambda: random.choice(self.pupils[1:]).process.freeze(random.choice((0.3, 2.0)))),
        ]
        self.world.plan(random, acts, 0.5, _FAULTS_S)

    def _fill(self) -> None:
        self.disk.fill()
        self.world.after(self.random.uniform(0.5, 4), lambda: setattr(self.disk, "is_full", False))

    def _freeze(self) -> None:
        if self.server and not self.server.is_dead:
            self.world.count("freeze")
            seconds = self.random.choice((0.2, 1.0))
            self.disturb(seconds)
            self.server.freeze(seconds)

    def heal(self) -> None:
        """Let all faults end; then, as the last one, cut the power once more."""
        self.world.note("heal")
        self.world.is_healed = True
        self.disk.heal()
        for link in self.network.links.values():
            link.down_until_s = 0.0
        for stranger in self.strangers:
            stranger.process.end()
        if self.random.random() < 0.5:
            self.kill(self.random.random() < 0.7)


def run_class(room: World) -> None:
    """Run the scenario; raises the first promise that is broken."""
    run = Class(room)
    with replaced(run.names()):
        run.begin()
        run.supervise()
        run.plan()
        for member in (run.teacher, *run.pupils, *run.strangers):
            member.start()
        watch_memory(room, lambda: run.loop, _MOST_WAITING_BYTES)
        room.at(_FAULTS_S + 0.5, run.heal)
        room.run(90.0)
        room.keep("class-goes-on", room.is_over, "the last request never ended")
