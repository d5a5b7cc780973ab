"""The wheels of the simulated car, and what is promised of them, checked after each step."""

from collections.abc import Callable

from tests.faults.network import Link
from tests.faults.world import Process, World

Setpoint = tuple[int, int, int]
NEUTRAL = (90, 1, 0)
# The profile's limits, as docs/security.md and docs/drive.md have them.
FAILSAFE_S, KILLED_S, STALE_S, ANSWER_S, SILENCE_S, HAND_OVER_S = 0.300, 0.330, 0.150, 1.0, 4.0, 5.0
# Steps of stamps and clocks, and the time of a thread to run.
_STEPS_S = 0.012
# A car waits so long for a second command, until it believes a first one without a stamp.
_ALONE_S = 0.050
# Hardware that fails is told again so long afterwards.
_RETRY_S = 0.050
# A loop needs so long to learn that a connection has ended.
_AT_ONCE_S = 0.01


class Pins:
    """Pins keep their last state, whatever becomes of the process that set them.

    Attributes:
        sent_s: when each command that moves the wheels was sent first and last, and by whom: clients repeat it.
        is_halted: whether an emergency stop was answered that nobody has begun to lift.
        is_ending: whether the last driver leaves.
        unstamped: the links of drivers whose commands don't say when they were sent.
        has_strangers: whether anybody else may ask for the wheel at any time.
        is_free: whether another driver may have got the wheel since the last command.
        moved: called with each command that moves the wheels: the driver, and the setpoint.
        fails: how many of the next operations fail.
        hangs_s: for how long the next operation hangs.
        is_hanging: whether one hangs now; the wheels stop, and go on where that was short.
        held_until_s: so long a process that has ended still holds them.
        has_guard: whether a guard watches over the process.
    """

    def __init__(self, world: World) -> None:
        self.world = world
        self.setpoint: Setpoint = NEUTRAL
        self.horn = False
        self.moved_s = 0.0
        self.driver: int | None = None
        self.sent_s: dict[Setpoint, tuple[float, float, int]] = {}
        self.still_sent_s: dict[int, float] = {}
        self.unstamped: dict[int, Link] = {}
        self.held_until_s = 0.0
        self.moved: list[Callable[[int, Setpoint], None]] = []
        self.horn_sent_s = -10.0
        self.released_s: dict[int, float] = {}
        self.wanted_by: set[int] = set()
        self.is_halted = self.has_strangers = self.is_ending = False
        self.is_armed = self.is_free = True
        self.has_guard = True
        self.fails = 0
        self.hangs_s = 0.0
        self.is_hanging = False
        self.stopped_s = -1.0
        self._lateness_s = 0.0
        self._disturbed_until_s = self._guarded_until_s = self._failed_s = 0.0
        # When the driver's connection ended while the wheels turned.
        self._gone_s: float | None = None
        # Of the present connection of each driver: the least age of a command, and when the last one came.
        self._fastest_s: dict[int, tuple[float, float]] = {}

    def begin(self, process: Process) -> None:
        """A server of the car starts: it knows nothing of what was before."""
        self._lateness_s = process.lateness_s
        self.is_halted = False
        self.is_armed = self.is_free = self.has_guard = True
        self._fastest_s.clear()
        # What comes before the server is ready waits in the system.
        self.disturb(0.0)

    def disturb(self, seconds: float, is_guarded: bool = False) -> None:
        """The car's software doesn't run as it should for a time; ``is_guarded``: the guard has to stop the wheels."""
        until_s = self.world.now_s + seconds
        self._disturbed_until_s = max(self._disturbed_until_s, until_s)
        if is_guarded:
            self._guarded_until_s = max(self._guarded_until_s, until_s)

    @property
    def is_disturbed(self) -> bool:
        return self.was_disturbed(self.world.now_s)

    def was_disturbed(self, since_s: float) -> bool:
        """Whether the car's software didn't run as it should at some time since then."""
        return since_s <= self._disturbed_until_s + KILLED_S

    def leave(self, driver: int, is_present: bool, moves: bool) -> None:
        """A driver's connection has ended: the present one, or one before it, which the car misses only now.

        ``moves``: the last command that moved the wheels came by it, and not by one that is half open.
        """
        self.is_free = True
        if not is_present:
            return
        self._fastest_s.pop(driver, None)
        self.wanted_by.discard(driver)
        if moves and driver == self.driver and self.setpoint[2]:
            self._gone_s = self.world.now_s

    def fail(self) -> None:
        """A command of the wheels fails: what they do then, nobody knows, so they have to be stopped."""
        self.is_armed = False
        self._failed_s = self.world.now_s

    # What the hardware is told.

    def apply(self, setpoint: Setpoint, begin_s: float) -> None:
        """Take a command, which the car began to execute at ``begin_s``."""
        world = self.world
        world.note("apply", *setpoint)
        if setpoint[2] == 0:
            self.is_armed = True
            self.setpoint = setpoint
            return
        world.keep("sent", setpoint in self.sent_s, f"nobody sent {setpoint}")
        first_s, last_s, driver = self.sent_s[setpoint]
        if driver in self.unstamped:
            self._check_delay(self.unstamped[driver], last_s, begin_s)
        else:
            self._check_age(driver, begin_s - last_s, begin_s - first_s)
        # A command that hung in the hardware is older than the stop; the next call stops the wheels again.
        hung = begin_s <= self.stopped_s
        # With speed 0 the wheel may pass to another at once, so that the hardware is told nothing.
        still_s = max(self.still_sent_s.values(), default=-10.0)
        is_armed = self.is_armed or hung or still_s > self.stopped_s - ANSWER_S - STALE_S
        world.keep("armed", is_armed, "no command with speed 0 came after the wheels were stopped")
        world.keep("stop-holds", not self.is_halted, f"driver {driver} moves the car after an emergency stop")
        if driver != self.driver:
            is_silent = world.now_s - self.moved_s > HAND_OVER_S
            may = self.has_strangers or self.is_free or self.is_ending or driver in self.wanted_by or is_silent
            may = may or self._has_released()
            world.keep("one-driver", may and self.setpoint[2] == 0, f"driver {driver} drives instead of {self.driver}")
        world.keep("guarded", self.has_guard or self.is_disturbed, "the car drives without its guard")
        self.wanted_by.discard(driver)
        self._gone_s = None
        self.setpoint, self.moved_s, self.driver, self.is_free = setpoint, world.now_s, driver, False
        for act in self.moved:
            act(driver, setpoint)

    def _check_age(self, driver: int, age_s: float, most_age_s: float) -> None:
        fastest_s, last_s = self._fastest_s.get(driver, (ANSWER_S, -10.0))
        if self.world.now_s - last_s > SILENCE_S - 0.2:
            fastest_s = ANSWER_S
        late_s = fastest_s + STALE_S + _STEPS_S + 2 * self._lateness_s
        self.world.keep("no-old-command", age_s <= late_s, f"{age_s:.3f} s old; the fastest took {fastest_s:.3f} s")
        self._fastest_s[driver] = min(most_age_s, fastest_s), self.world.now_s

    def _check_delay(self, link: Link, sent_s: float, begin_s: float) -> None:
        """Without stamps nobody sees that a command is old: only the network may delay it, and the first one belief."""
        late_s = link.delay_s + link.jitter_s + _ALONE_S + _STEPS_S + 2 * self._lateness_s
        if not self.is_disturbed and begin_s > link.late_until_s + late_s:
            self.world.keep("no-old-command", begin_s - sent_s <= late_s, f"{begin_s - sent_s:.3f} s old, no stamp")

    def neutral(self, by: str) -> None:
        """Stop the wheels."""
        self.world.note("neutral", by)
        self.stopped_s = self.world.now_s
        if self.setpoint[2] and not self.is_hanging:
            # A command with speed 0 passes the wheel on to whoever has asked for it: that is no stop by itself.
            still_s = self.still_sent_s.get(self.driver or 0, -10.0)
            is_handed_over = bool(self.wanted_by) and still_s > self.moved_s - ANSWER_S - STALE_S
            self.is_armed = is_handed_over or self._has_released()
        self.setpoint = NEUTRAL
        self._gone_s = None

    def _has_released(self) -> bool:
        """Whether the driver has given the wheel back; commands may come a little later."""
        return self.released_s.get(self.driver or 0, -10.0) > self.world.now_s - SILENCE_S

    def request(self, driver: int) -> None:
        """A driver asks for the wheel: from now on it may pass to that driver."""
        self.wanted_by.add(driver)

    def release(self, driver: int) -> None:
        """A driver gives the wheel back, perhaps some time later: the next one needs no command with speed 0."""
        self.is_free = True
        self.wanted_by.discard(driver)
        self.released_s[driver] = self.world.now_s

    def switch(self, name: str, is_on: bool) -> None:
        self.world.note("switch", name, is_on)
        if name == "horn":
            self.horn = is_on

    # What is promised.

    def check(self) -> None:
        """Check whenever time has passed."""
        keep, now_s = self.world.keep, self.world.now_s
        if self.setpoint[2]:
            # Hardware that fails is told again.
            since_s = max(self.moved_s, self._failed_s)
            limit_s = KILLED_S if now_s <= self._guarded_until_s else FAILSAFE_S
            limit_s += _STEPS_S + 3 * self._lateness_s
            silent_s = now_s - since_s
            keep("stands-in-time", silent_s <= limit_s, "the wheels turn {:.3f} s later", silent_s)
            is_told_again = now_s - self._failed_s <= _RETRY_S + _STEPS_S + 3 * self._lateness_s
            is_standing = not self.is_halted or is_told_again
            keep("stop-holds", is_standing, "the wheels turn after an emergency stop")
            if self._gone_s is not None and not self.is_disturbed:
                gone_s = now_s - self._gone_s
                is_standing = is_told_again or gone_s <= _AT_ONCE_S + 3 * self._lateness_s
                keep("gone-stops", is_standing, "{:.3f} s later", gone_s)
        if self.horn and not self.is_disturbed:
            silent_s = now_s - self.horn_sent_s
            keep("horn-ends", silent_s <= FAILSAFE_S + ANSWER_S + STALE_S + 0.1, "{:.3f} s", silent_s)


def fields(word: int) -> tuple[int, Setpoint]:
    """The code of a drive word, and its setpoint where the code is 1."""
    return word >> 28, (word >> 20 & 255, word >> 19 & 1, word >> 11 & 255)
