"""A stick made of keys: pure, with time as an argument (seconds). Letting go of the keys lets go of the stick.

Most terminals tell of a key only when it is pressed and again and again while it is held, of the newest key alone. So
keys that are pressed together live as long as the newest one repeats, and a while after its last repetition all are
taken as released. Terminals of the kitty protocol tell of releases too; their keys stay down until released, yet no
longer than ``LONGEST_HOLD_S`` after anything was heard, since a connection to a terminal can break.
"""

LONGEST_HOLD_S = 1.0

AHEAD, BACK, LEFT, RIGHT = "ahead", "back", "left", "right"
_OPPOSITE = {AHEAD: BACK, BACK: AHEAD, LEFT: RIGHT, RIGHT: LEFT}


class KeyStick:
    """The keys that are down, as axes.

    Args:
        hold_s: how long a key counts as held after it was last heard of, where releases aren't told.
        tells_releases: whether the terminal tells of them.
    """

    def __init__(self, hold_s: float, tells_releases: bool):
        self._lasts_s = LONGEST_HOLD_S if tells_releases else hold_s
        self._down: set[str] = set()
        self._heard_s = 0.0

    def press(self, key: str, now_s: float) -> None:
        """AHEAD, BACK, LEFT or RIGHT is pressed, or repeats."""
        self._expire(now_s)
        self._down.discard(_OPPOSITE[key])
        self._down.add(key)
        self._heard_s = now_s

    def release(self, key: str, now_s: float) -> None:
        """The key is up."""
        self._expire(now_s)
        self._down.discard(key)
        self._heard_s = now_s

    def let_go(self) -> None:
        """All keys are up."""
        self._down.clear()

    def axes(self, now_s: float) -> tuple[int, int]:
        """Throttle and steering, each -1, 0 or 1, as `motorcade.drive.input.stick` takes them."""
        self._expire(now_s)
        return (AHEAD in self._down) - (BACK in self._down), (RIGHT in self._down) - (LEFT in self._down)

    def _expire(self, now_s: float) -> None:
        if now_s - self._heard_s > self._lasts_s:
            self._down.clear()
