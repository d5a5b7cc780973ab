"""Driving in the simulated room: a car and its guard, drivers, who stops it, strangers, and all faults."""

import asyncio
from functools import partial
from random import Random
from types import SimpleNamespace
from typing import Any

from tests.faults.drivers import Driver, SeedDriver, Stranger, Watcher
from tests.faults.loop import SimulatedLoop, check_connections, watch_memory
from tests.faults.network import Network, Socket
from tests.faults.processes import System
from tests.faults.system import THREADS, Replaced, in_threads, replaced
from tests.faults.wheels import Pins
from tests.faults.world import Faults, Process, World, world

from motorcade.car.drive_board import DriveBoard
from motorcade.config.profile import built_in_profile
from motorcade.drive import client as drive_client
from motorcade.drive import motor_guard
from motorcade.drive import server as drive_server
from motorcade.drive import session as drive_session
from motorcade.drive.channels import Clients
from motorcade.drive.server import serving, watched
from motorcade.drive.session import CarControl
from motorcade.timing import to_ticks
from motorcade.words.ticks import TICKS_MASK

PROFILE = built_in_profile("classroom")
COMMANDS, TELEMETRY = 5005, 5006
# What a listener keeps, and a few that it is about to drop.
_MOST_CONNECTIONS, _MOST_OF_ONE = 64 + 4, 16 + 4
_FAULTS_S, _START_S = 5.5, 1.0
# What waits for one client: a frame of telemetry, or the answers before the client is dropped.
_MOST_WAITING_BYTES = (1 << 14) + (1 << 11)
# The system frees the pins of a process so long after its end.
_MOST_HELD_S = 0.01
_pins: Pins | None = None


def rescue() -> None:
    """Stop the wheels from the guard; the pins of a process are free only some time after its end."""
    assert _pins
    if world().now_s < _pins.held_until_s:
        raise OSError("the pins are held")
    _pins.neutral("guard")
    for name in FailingBoard.switches:
        _pins.switch(name, False)


class FailingBoard(DriveBoard):
    """The hardware of the car: it may fail, and hang."""

    switches = ("head_light", "horn")

    def __init__(self, pins: Pins) -> None:
        self._pins = pins

    def _operate(self, stops: bool) -> None:
        pins = self._pins
        if pins.hangs_s and not stops:
            hangs_s, pins.hangs_s = pins.hangs_s, 0.0
            pins.world.count("hardware hangs")
            pins.disturb(hangs_s)
            pins.is_hanging = True
            # The command that hangs is the last one that came.
            pins.moved_s = pins.world.now_s
            pins.world.sleep(hangs_s)
            pins.is_hanging = False
        if pins.fails > 0:
            pins.fails -= 1
            pins.world.count("hardware fails")
            pins.fail()
            raise OSError("the chip gives no answer")

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        begin_s = self._pins.world.now_s
        self._operate(False)
        self._pins.apply((angle_deg, direction, speed), begin_s)

    def neutral(self) -> None:
        self._operate(True)
        self._pins.neutral("car")

    def set_switch(self, name: str, is_on: bool) -> None:
        self._pins.switch(name, is_on)

    def rescue(self) -> tuple[str, tuple[str, ...]]:
        return "tests.faults.driving:rescue", ()


class Driving:
    """One run: a car and all who are connected to it."""

    def __init__(self, room: World) -> None:
        self.world = room
        self.random = random = Random(f"{room.seed} plan")
        self.network = Network(room)
        self.pins = Pins(room)
        self.system = System({"motorcade.drive.motor_guard": motor_guard.main})
        self.car: Process | None = None
        self.loop: SimulatedLoop | None = None
        self.started_s = 0.0
        for name in ("driver 0", "driver 1", "driver 2", "stranger 0", "stranger 1", "stranger 2", "stranger 3"):
            delay_s = random.choice((0.002, 0.01, 0.04))
            self.network.link(name, delay_s, random.choice((0.0, 0.005, 0.03)), random.choice((0, 0, 0, 0.02)))
        self.network.link("watcher", 0.003)
        self.network.watch = self._connected
        self.drivers = [Driver(self, 0, rearm=True), Driver(self, 1, rearm=False)]
        # Where others drive too, their commands with speed 0 would hide that a client moves a car without arming it.
        self.others_begin_s = _FAULTS_S if random.random() < 0.15 else 0.0
        if self.others_begin_s or random.random() < 0.3:
            self.drivers.append(SeedDriver(self, 2, rearm=True))
            self.pins.unstamped[2] = self.network.links["driver 2"]
        self.watcher = Watcher(self)
        # A draw of its own: without it the other seeds would be other runs.
        is_crowd = Random(f"{room.seed} crowd").random() < 0.04
        some = [number for number in range(4) if random.random() < 0.1]
        self.strangers = [Stranger(self, number, is_crowd) for number in (range(4) if is_crowd else some)]
        self.pins.has_strangers = bool(self.strangers)
        room.checks.append(self.pins.check)
        self.pins.moved.append(lambda driver, setpoint: self.drivers[driver].note_moved(setpoint))
        watch_memory(room, lambda: self.loop, _MOST_WAITING_BYTES)

    def _connected(self, name: str, port: int, socket: Socket) -> None:
        if port == COMMANDS and name.startswith("driver"):
            driver = self.drivers[int(name[-1])]
            socket.tap = partial(driver.note_words, socket)
            assert socket.peer
            driver.connect(socket)
            socket.peer.ended = partial(driver.leave, socket)
        if port in (COMMANDS, TELEMETRY):
            check_connections(self.network, socket, _MOST_OF_ONE, _MOST_CONNECTIONS)

    # The car.

    def start_car(self) -> None:
        """Start the car's server."""
        process = self.car = Process(self.world, "car", self.random.choice((0.001, 0.001, 0.01)))
        process.at_end.append(self._hold_pins)
        process.offset_s = self.random.choice((0.0, (TICKS_MASK - 3000) / 1000, self.random.uniform(0, 1e6)))
        loop = self.loop = SimulatedLoop(process, self.network)
        self.started_s = self.world.now_s
        self.pins.begin(process)

        async def serve() -> None:
            try:
                control = CarControl(FailingBoard(self.pins), lambda: to_ticks(loop.time()), PROFILE)
            except OSError:
                # The server says that it can't stop the wheels, and ends.
                process.end()
                return
            sockets = [self.network.listen(process, "car", port) for port in (COMMANDS, TELEMETRY)]
            async with watched(control), serving(Clients(control), *sockets):  # type: ignore[arg-type]
                await asyncio.Event().wait()

        loop.run(serve)

    def _hold_pins(self) -> None:
        self.pins.held_until_s = self.world.now_s + self.random.choice((0.0, 0.004, _MOST_HELD_S))

    def guard(self) -> Process | None:
        """The process of the guard, while it runs."""
        return next((each for each in self.world.processes if each.name == "car's guard" and not each.is_dead), None)

    def _guarded(self) -> Process | None:
        """The car's server, where it runs and its guard is well."""
        guard = self.guard()
        is_well = self.car and not self.car.is_dead and guard and guard.frozen_until_s <= self.world.now_s
        return self.car if is_well else None

    def kill_car(self) -> None:
        """Kill the car's server, where its guard is well; it starts again some time later."""
        if car := self._guarded():
            self.world.count("kill")
            self.pins.disturb(0.5, is_guarded=True)
            car.end()

    def freeze_car(self) -> None:
        """Freeze the whole server; the guard kills it, if the wheels turn."""
        if car := self._guarded():
            self.world.count("freeze")
            seconds = self.random.choice((0.05, 0.15, 0.4, 1.5))
            self.pins.disturb(seconds + 0.5, is_guarded=True)
            car.freeze(seconds)

    def hurt_while_silent(self) -> None:
        """Kill or freeze the server when its driver's last command is about to end."""
        driver = self.pins.driver
        if driver in (0, 1):
            self.network.links[f"driver {driver}"].stall(0.8)
            act = self.random.choice((self.kill_car, self.freeze_car, self.freeze_car))
            self.world.after(self.random.uniform(0.1, 0.35), self.world.unless_healed, act)

    def stall_loop(self) -> None:
        """Keep the loop that takes the commands busy."""
        if self.car is None or self.car.is_dead:
            return
        seconds = self.random.choice((0.05, 0.25, 0.5, 2.5))
        self.world.count("busy loop")
        self.pins.disturb(seconds)

        def wait() -> None:
            # Where the hardware hangs, it begins later.
            self.pins.disturb(seconds)
            self.world.sleep(seconds)

        assert self.loop
        self.loop.soon(wait)

    def hurt_guard(self) -> None:
        """Kill or freeze the guard: the car stands until its server is started again."""
        guard = self.guard()
        if guard is None or self.car is None or self.car.is_dead or self.car.frozen_until_s > self.world.now_s:
            # Nothing is promised where the server and its guard fail at one moment.
            return
        if self.world.now_s < self.started_s + _START_S:
            # A server whose guard doesn't come says so and doesn't start.
            return
        self.world.count("guard")
        self.pins.disturb(0.3)
        if self.random.random() < 0.5:
            guard.end()
        else:
            guard.freeze(20.0)
        self.pins.has_guard = False
        self.world.after(self.random.uniform(1, 3), self._restart)

    def _restart(self) -> None:
        assert self.car
        self.car.end()
        if guard := self.guard():
            guard.end()

    def supervise(self) -> None:
        """Start the server again some time after it has ended, as a service does."""
        if self.car is None or (self.car.is_dead and not self.guard()):
            self.start_car()
        self.world.after(self.random.uniform(0.4, 1.2), self.supervise)

    # Faults.

    def plan(self) -> None:
        """Draw what goes wrong, and when."""
        random, room = self.random, self.world
        links = [self.network.links[f"driver {number}"] for number in range(2)]
        stalls = (0.1, 0.3, 0.8, 2.5, 4.5, random.uniform(8.0, 8.6))
        acts: Faults = [
            (0.7, lambda: random.choice(links).stall(random.choice(stalls))),
            (0.3, lambda: random.choice(links).stall(random.choice(stalls))),
            (0.3, lambda: random.choice(links).cut()),
            (0.2, lambda: random.choice(links).forget_one_end()),
            (0.2, lambda: random.choice(self.drivers).freeze()),
            (0.15, self.kill_car),
            (0.2, self.freeze_car),
            (0.2, self.stall_loop),
            (0.12, self.hurt_guard),
            (0.2, self.hurt_while_silent),
            (0.15, lambda: setattr(self.pins, "fails", random.randint(1, 4))),
            (0.12, lambda: setattr(self.pins, "hangs_s", random.choice((0.1, 0.4, 1.0)))),
            (0.1, lambda: setattr(random.choice(self.drivers[:2]), "stalls", True)),
        ]
        room.plan(random, acts, 0.8, _FAULTS_S)

    def heal(self) -> None:
        """Begin no new faults, and end all but stalls."""
        self.world.note("heal")
        self.world.is_healed = True
        self.pins.fails, self.pins.hangs_s = 0, 0.0
        # Stalls end by themselves: a stamp comes round in the longest.
        for link in self.network.links.values():
            link.loss = 0.0
        for stranger in self.strangers:
            stranger.process.end()

    def names(self) -> Replaced:
        return (
            in_threads()
            | self.system.names(motor_guard)
            | {
                (drive_session, "threading"): THREADS,
                (drive_server, "threading"): THREADS,
                (drive_client, "random"): SimpleNamespace(uniform=self.random.uniform),
            }
        )


def run_driving(room: World) -> None:
    """Run the scenario; raises the first promise that is broken."""
    global _pins
    run: Any = Driving(room)
    _pins = run.pins
    with replaced(run.names()):
        run.supervise()
        run.plan()
        for each in (*run.drivers, run.watcher, *run.strangers):
            each.start()
        room.at(_FAULTS_S + 0.5, run.heal)
        room.run(60.0)
        room.keep("drives-again", room.is_over, "the last drive never ended")
    _pins = None
