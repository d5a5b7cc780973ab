"""What a client sends to a car, and when: pure, with time as an argument (ms that wrap, `motorcade.words.ticks`).

The car stops by itself when it hears nothing fresh. So the last wish is repeated, and a wish that its caller doesn't
renew dies here: a program that hangs can't keep a car driving through a connection that still works.
"""

from motorcade.car.arbiter import NEUTRAL
from motorcade.words.formats import DRIVE
from motorcade.words.ticks import elapsed_ms

# Telemetry that is still under way may tell of a failsafe that has been answered already.
_BELIEVED_AFTER_MS = 500
# A car executes the newest command alone, so what moves it mustn't catch up with what armed it.
_ARMS_ALONE_MS = 40


class CommandStream:
    """The last wish of a caller, and how long it counts.

    After a failsafe a car wants one command with speed 0 before it drives again.

    Args:
        fresh_ms: how long a wish counts.
        rearm: whether the helm sends that command by itself. Without it the car stands until the caller has wished
            speed 0 or nothing for a while, as a hand that lets go of a stick does.
    """

    def __init__(self, fresh_ms: int, rearm: bool):
        self._fresh_ms = fresh_ms
        self._rearm = rearm
        self._wish: int | None = None
        self._wished_ms = 0
        self._armed = False
        self._armed_ms = 0
        self._let_go = True

    @property
    def waits_for_release(self) -> bool:
        """Whether the car stands until the caller lets go."""
        return not (self._armed or self._rearm or self._let_go)

    def wish(self, word: int, now_ms: int) -> None:
        """The caller wants the DRIVE word ``word`` from now on."""
        self._wish, self._wished_ms = word, now_ms
        if _stands(word):
            self._let_go = True

    def drop(self) -> None:
        """The caller wants nothing any more: nothing is sent until the next wish."""
        self._wish, self._armed, self._let_go = None, False, True

    def disarm(self) -> None:
        """The connection is a new one: its car may want a command with speed 0 first."""
        self._armed = False
        self._let_go = self._wish is None or _stands(self._wish)

    def hear_failsafe(self, now_ms: int) -> None:
        """The car says that it stopped by itself."""
        if self._armed and elapsed_ms(now_ms, self._armed_ms) >= _BELIEVED_AFTER_MS:
            self.disarm()

    def next_word(self, now_ms: int) -> int | None:
        """What to send now; None where silence is right. To be asked at every period, and sent at once."""
        if self._wish is None:
            return None
        if elapsed_ms(now_ms, self._wished_ms) > self._fresh_ms:
            self.drop()
            return NEUTRAL
        if not self._armed:
            if self.waits_for_release:
                return None
            self._armed, self._armed_ms = True, now_ms
            return self._wish if _stands(self._wish) else NEUTRAL
        if elapsed_ms(now_ms, self._armed_ms) < _ARMS_ALONE_MS and not _stands(self._wish):
            return NEUTRAL
        return self._wish


def _stands(word: int) -> bool:
    return not DRIVE.decode(word).speed
