"""Dead-man's switches: what keys or a program command, and how long it counts.

Pure, with time as an argument: seconds for keys, otherwise milliseconds that wrap (`motorcade.words.ticks`). Nothing
starts by itself, and nothing goes on that nobody renews.
"""

from motorcade.car.arbiter import NEUTRAL
from motorcade.words.formats import DRIVE
from motorcade.words.ticks import elapsed_ms

# Keys that were pressed keep the wheel for so long after their release: longer than a change of direction takes,
# shorter than others like to wait.
RESTS_MS = 2000

AHEAD, BACK, LEFT, RIGHT = "ahead", "back", "left", "right"

_OPPOSITE = {AHEAD: BACK, BACK: AHEAD, LEFT: RIGHT, RIGHT: LEFT}
_FULL_DUTY = 255
_CENTRE_DEG = 90
# Telemetry that was sent before the car was armed may still report a failsafe.
_BELIEVED_AFTER_MS = 500
# A car executes the newest of the commands that come together: what moves it mustn't come with what arms it.
_ARMS_ALONE_MS = 40

Axes = tuple[float, float]


def stick_word(throttle: float, steering: float) -> int:
    """The DRIVE word of a stick.

    Args:
        throttle: -1 full speed back, 0 standing still, 1 full speed ahead.
        steering: -1 full left, 0 straight on, 1 full right, as a stick's horizontal axis.

    Raises:
        ValueError: one of them is out of range or no number.
    """
    for name, value in (("throttle", throttle), ("steering", steering)):
        # Written so that nan is refused too.
        if not -1 <= value <= 1:
            raise ValueError(f"{name} is {value!r}; allowed: -1 to 1")
    return DRIVE.encode(
        code=1,
        angle=_CENTRE_DEG - round(steering * _CENTRE_DEG),
        direction=int(throttle >= 0),
        speed=round(abs(throttle) * _FULL_DUTY),
    )


class DeadmanSwitch:
    """Decide what keys command.

    Released keys command the car to stand still, and after RESTS_MS nothing, so that others can have the wheel. Keys
    that are held at the first look, or through an order, command nothing until they have been released.
    """

    def __init__(self) -> None:
        self._must_rest = True
        self._is_silent = True
        self._pushed_ms = 0

    @property
    def must_rest(self) -> bool:
        """Whether the keys have to be released before they can drive."""
        return self._must_rest

    def withdraw(self) -> None:
        """Command nothing from now on, and require a release."""
        self._must_rest = self._is_silent = True

    def update(self, axes: Axes, now_ms: int) -> Axes | None:
        """What throttle and steering command now: themselves, zeros to stand still, or None for nothing."""
        if not any(axes):
            self._must_rest = False
        elif not self._must_rest:
            self._pushed_ms, self._is_silent = now_ms, False
            return axes
        if not self._is_silent and elapsed_ms(now_ms, self._pushed_ms) >= RESTS_MS:
            self._is_silent = True
        return None if self._is_silent else (0.0, 0.0)


class CommandStream:
    """Decide which word a client sends when.

    The car stops by itself when no fresh command comes, so the caller's last command is repeated. A command that the
    caller doesn't renew ends here: a program that hangs can't keep a car driving through a connection that works.
    After a failsafe a car needs one command with speed 0 before it drives again.

    Args:
        fresh_ms: how long a command of the caller counts.
        rearm: whether to send the command with speed 0 without being asked. If not, the car stands still until the
            caller has commanded speed 0 or nothing for a while, as one who releases a stick does.
    """

    def __init__(self, fresh_ms: int, rearm: bool) -> None:
        self._fresh_ms = fresh_ms
        self._rearm = rearm
        self._word: int | None = None
        self._set_ms = 0
        self._is_armed = False
        self._armed_ms = 0
        self._is_released = True

    @property
    def waits_for_release(self) -> bool:
        """Whether the car stands still until the caller commands speed 0 or nothing."""
        return not (self._is_armed or self._rearm or self._is_released)

    def set_word(self, word: int, now_ms: int) -> None:
        """Command the DRIVE word ``word`` from now on."""
        self._word, self._set_ms = word, now_ms
        if _stands(word):
            self._is_released = True

    def drop(self) -> None:
        """Command nothing until the next `set_word`."""
        self._word, self._is_armed, self._is_released = None, False, True

    def disarm(self) -> None:
        """Note that the connection is a new one: its car may need a command with speed 0 first."""
        self._is_armed = False
        self._is_released = self._word is None or _stands(self._word)

    def stand_first(self) -> None:
        """Note that the car obeys the next word with a speed only after one with speed 0, as it did long ago."""
        self._is_armed = False

    def receive_failsafe(self, now_ms: int) -> None:
        """Note that the car reports a failsafe."""
        if self._is_armed and elapsed_ms(now_ms, self._armed_ms) >= _BELIEVED_AFTER_MS:
            self.disarm()

    def next_word(self, now_ms: int) -> int | None:
        """What to send now, at once; None for nothing. To be called once in each period."""
        if self._word is None:
            return None
        if elapsed_ms(now_ms, self._set_ms) > self._fresh_ms:
            self.drop()
            return NEUTRAL
        if not self._is_armed:
            if self.waits_for_release:
                return None
            self._is_armed, self._armed_ms = True, now_ms
            return self._word if _stands(self._word) else NEUTRAL
        if elapsed_ms(now_ms, self._armed_ms) < _ARMS_ALONE_MS and not _stands(self._word):
            return NEUTRAL
        return self._word


class KeyStick:
    """Make axes of keys.

    Most terminals report a key only when it is pressed and repeatedly while it is held, and of several keys the newest
    alone. So keys that are pressed together count while the newest one repeats, and all are released ``hold_s`` after
    its last repetition.
    """

    def __init__(self, hold_s: float) -> None:
        self._hold_s = hold_s
        self._down: set[str] = set()
        self._event_s = 0.0

    def press(self, key: str, now_s: float) -> None:
        """Note that AHEAD, BACK, LEFT or RIGHT is pressed, or repeats."""
        self._expire(now_s)
        self._down.discard(_OPPOSITE[key])
        self._down.add(key)
        self._event_s = now_s

    def release_all(self) -> None:
        """Count all keys as released."""
        self._down.clear()

    def axes(self, now_s: float) -> tuple[int, int]:
        """Throttle and steering, each -1, 0 or 1, as `stick_word` takes them."""
        self._expire(now_s)
        return (AHEAD in self._down) - (BACK in self._down), (RIGHT in self._down) - (LEFT in self._down)

    def _expire(self, now_s: float) -> None:
        if now_s - self._event_s > self._hold_s:
            self._down.clear()


def _stands(word: int) -> bool:
    return not DRIVE.decode(word).speed
