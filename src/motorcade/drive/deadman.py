"""The dead-man switch of everybody who drives: which command is sent when, as one table of states.

A car stops by itself when no fresh command comes, so a command is repeated while its caller renews it, and no longer: a
program that hangs, or a stick that nobody holds, can't keep a car driving. After a failsafe a car needs one command
with speed 0 before it drives again.

Pure, with the time as an argument in milliseconds that wrap (`motorcade.words.ticks`). The page's switch
(web/src/remote/link.ts) follows the same table, which scripts/driving_types.py writes for it, and both pass
tests/drive/deadman_cases.json.
"""

from collections.abc import Mapping

from motorcade.words.formats import SWITCHES
from motorcade.words.ticks import TICKS_MASK, elapsed_ms

IDLE, ARMING, DRIVING, RESTING, LOCKED = range(5)
STATES = (
    ("idle", "nothing is sent"),
    ("arming", "speed 0 is sent, so that the car is armed before it moves"),
    ("driving", "the command is sent"),
    ("resting", "speed 0 is sent again and again, in case a message is lost"),
    ("locked", "nothing is sent until speed 0 or nothing is commanded"),
)
SPEED, STILL, NOTHING, LOST, AGAIN, ORDER, OVER = range(7)
EVENTS = (
    ("speed", "a speed is commanded"),
    ("still", "speed 0 is commanded"),
    ("nothing", "the command is withdrawn, or was not renewed for fresh_ms"),
    ("lost", "the car may have stopped by itself while a person commands a speed"),
    ("again", "the car may have stopped by itself, and is armed anew"),
    ("order", "the caller stops the car, gives it back or lets its program drive"),
    ("over", "the state has lasted for its time in LASTS_MS"),
)
# State, event, next state. An event that is not listed for a state changes nothing.
TABLE = (
    (IDLE, SPEED, ARMING),
    (IDLE, STILL, ARMING),
    (ARMING, NOTHING, RESTING),
    (ARMING, LOST, LOCKED),
    (ARMING, AGAIN, ARMING),
    (ARMING, ORDER, IDLE),
    (ARMING, OVER, DRIVING),
    (DRIVING, NOTHING, RESTING),
    (DRIVING, LOST, LOCKED),
    (DRIVING, AGAIN, ARMING),
    (DRIVING, ORDER, IDLE),
    (RESTING, SPEED, ARMING),
    (RESTING, STILL, ARMING),
    (RESTING, LOST, IDLE),
    (RESTING, AGAIN, IDLE),
    (RESTING, ORDER, IDLE),
    (RESTING, OVER, IDLE),
    (LOCKED, STILL, ARMING),
    (LOCKED, NOTHING, RESTING),
)
# How long a state lasts. A car executes the newest of the commands that come together: what moves it mustn't come with
# what arms it, but is sent in the next period.
LASTS_MS = ((ARMING, 45), (RESTING, 200))
# How often a command is sent, and how long it counts unless a client says otherwise.
PERIOD_MS = 50
FRESH_MS = 300
# Telemetry that was sent before the car was armed may still report a failsafe.
_BELIEVED_AFTER_MS = 500

Axes = tuple[float, float]
_AT_REST: Axes = (0.0, 0.0)
_NEXT = {(state, event): following for state, event, following in TABLE}
_LASTS_MS = dict(LASTS_MS)
_HELD = [switch.name for switch in SWITCHES if switch.is_held]


class DeadmanSwitch:
    """Decide what is sent when.

    Args:
        fresh_ms: how long a command counts that isn't renewed.
        rearm: whether a car that has stopped by itself is armed again although a speed is commanded, as a program wants
            it. A person has to release the stick first.
    """

    def __init__(self, fresh_ms: int = FRESH_MS, rearm: bool = False) -> None:
        self._fresh_ms = fresh_ms
        self._rearm = rearm
        self._state = IDLE
        # When something was first sent in this state: a car is armed by what is sent, not by what waits.
        self._since_ms: int | None = None
        self._axes = _AT_REST
        self._commanded_ms = 0
        # What is switched beside the wheels, by name: 0 or 1, and when that was commanded.
        self._switches: dict[str, tuple[int, int]] = {}

    @property
    def is_locked(self) -> bool:
        """Whether nothing is sent until speed 0 or nothing is commanded."""
        return self._state == LOCKED

    def command(self, throttle: float, steering: float, now_ms: int, switches: Mapping[str, int] | None = None) -> None:
        """Command throttle and steering, -1 to 1, for the next ``fresh_ms``; and ``switches``, 0 or 1 by name.

        A switch that was held and isn't named is switched off.
        """
        self._axes, self._commanded_ms = (throttle, steering), now_ms
        self._lift(now_ms)
        self._switches |= {name: (value, now_ms) for name, value in (switches or {}).items()}
        self._take(SPEED if throttle else STILL)

    def release(self, now_ms: int) -> None:
        """Command nothing any more."""
        self._lift(now_ms)
        self._take(NOTHING)

    def order(self) -> None:
        """Command nothing because of an order, such as an emergency stop; a stick that is held must be released."""
        self._take(LOST if self._needs_release else ORDER)

    def lose(self) -> None:
        """Note that the connection is a new one, or that the car reports a failsafe."""
        self._take(LOST if self._needs_release else AGAIN)

    def stand_first(self) -> None:
        """Note that the car obeys the next command with a speed only after one with speed 0, as it did long ago."""
        self._take(AGAIN)

    def receive_failsafe(self, now_ms: int) -> None:
        """Note that the car reports a failsafe."""
        since_ms = now_ms
        if self._since_ms is not None:
            since_ms = self._since_ms
        if self._state == DRIVING and elapsed_ms(now_ms, since_ms) >= _BELIEVED_AFTER_MS:
            self.lose()

    def next(self, now_ms: int) -> Axes | None:
        """Throttle and steering to send now; None for nothing."""
        if self._state != RESTING and elapsed_ms(now_ms, self._commanded_ms) > self._fresh_ms:
            self._take(NOTHING)
        if self._since_ms is not None and elapsed_ms(now_ms, self._since_ms) >= _LASTS_MS.get(self._state, TICKS_MASK):
            self._take(OVER)
        if self._since_ms is None:
            self._since_ms = now_ms
        throttle, steering = self._axes
        return {ARMING: (0.0, steering), DRIVING: (throttle, steering), RESTING: _AT_REST}.get(self._state)

    def switches(self, now_ms: int) -> dict[str, int]:
        """What to switch now, behind `next`: what was commanded in the last ``fresh_ms``."""
        if self._state in (IDLE, LOCKED):
            return {}
        switches = self._switches.items()
        return {name: value for name, (value, at_ms) in switches if elapsed_ms(now_ms, at_ms) <= self._fresh_ms}

    def _lift(self, now_ms: int) -> None:
        """Switch off what is held."""
        for name in _HELD:
            if self._switches.get(name, (0, 0))[0]:
                self._switches[name] = (0, now_ms)

    @property
    def _needs_release(self) -> bool:
        return self._axes[0] != 0 and not self._rearm

    def _take(self, event: int) -> None:
        following = _NEXT.get((self._state, event))
        if following is not None:
            self._state, self._since_ms = following, None
