"""Call a board's methods and note what is wrong with their answers.

Portable.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable
    from typing import Any

from motorcade.car.board import Board
from motorcade.car.check.observer import BoardObserver
from motorcade.errors import Phrase
from motorcade.words.ticks import TICKS_MASK, elapsed_ms

# A car ticks every few milliseconds: no call of its board may take much longer.
LONGEST_CALL_MS = 20
_TRIES = 3
# A clock that doesn't change in so many readings stands still; they take some seconds on a microcontroller.
_READS = 200000
_LONGEST_SHOWN = 60
_STEP_MS = 5
_GIVES_UP_MS = 1000


class BoardFailedError(Exception):
    """A method of the board raised an error, or takes other arguments; the breach is noted already."""


class Probe:
    """A board that is being checked.

    Args:
        wait_ms: lets that many milliseconds pass; None to watch the board's own clock.
        observer: shows what the board really did; None where nothing does.

    Attributes:
        breaches: what is wrong with it; ``str`` gives the sentence of each.
        missing: what wasn't given, so that a part of the board is not checked.
        clock_is_simulated: whether time passes only by ``wait_ms``.
    """

    def __init__(
        self, board: "Any", wait_ms: "Callable[[int], Any] | None", observer: "BoardObserver | None" = None
    ) -> None:
        self.board = board
        self.observer = observer or BoardObserver()
        self.breaches: list[Phrase] = []
        self.missing: list[str] = []
        self.clock_is_simulated = wait_ms is not None
        self._wait_ms = wait_ms

    def breach(self, breach: Phrase) -> None:
        """Note what is wrong, once."""
        if breach not in self.breaches:
            self.breaches.append(breach)

    def has_breach_of(self, method: str) -> bool:
        """Return whether a breach of that method is noted already; another one would not help the board's author."""
        return any(breach.details.get("method") == method for breach in self.breaches)

    def has_own(self, method: str) -> bool:
        """Return whether the board overrides that method of Board; otherwise it hasn't the hardware for it."""
        return getattr(type(self.board), method, None) is not getattr(Board, method)

    def miss(self, method: str, what: str) -> None:
        """Note that ``what`` wasn't given, which the check of that method needs."""
        if self.has_own(method) and what not in self.missing:
            self.missing.append(what)

    def offer(self, method: str, shown: str) -> "Any":
        """Return the observer's method ``shown``, which the check of the board's ``method`` needs.

        None where the board hasn't that method, or where nobody observes it, which is noted.
        """
        if not self.has_own(method):
            return None
        if getattr(type(self.observer), shown, None) in (None, getattr(BoardObserver, shown)):
            self.miss(method, "observe." + shown)
            return None
        return getattr(self.observer, shown)

    def settle(self, read: "Callable[[], Any]", fits: "Callable[[Any], bool]") -> "tuple[int | None, Any]":
        """Read until the reading fits, for at most a second.

        Returns:
            after how many ms a reading still didn't fit (0: the first one did), None where none fits; and the last one.
        """
        begin_ms, late_ms = self.call("now_ms"), 0
        while True:
            read_ms = elapsed_ms(self.call("now_ms"), begin_ms)
            value = read()
            if fits(value):
                return late_ms, value
            late_ms = read_ms
            if late_ms >= _GIVES_UP_MS:
                return None, value
            self.wait(_STEP_MS)

    def call(self, name: str, *arguments: object) -> "Any":
        """Call the board's method and return its result. Raises BoardFailedError."""
        return self.call_of(self.board, name, *arguments)

    def call_of(self, board: "Any", name: str, *arguments: object) -> "Any":
        """Call a method of another board of its kind. Raises BoardFailedError."""
        try:
            return getattr(board, name)(*arguments)
        except Exception as problem:  # noqa: BLE001 - the board's author has to see any error
            shown = ", ".join([brief(argument) for argument in arguments])
            error = f"{type(problem).__name__}: {problem}"
            self.breach(Phrase("check-raised", method=name, arguments=shown, error=error))
        raise BoardFailedError

    def timed(self, name: str, *arguments: object) -> "Any":
        """Call the method and return its first result; it is a breach if each of some calls takes long."""
        shortest_ms, value = TICKS_MASK, None
        for tries in range(_TRIES):
            begin_ms = self.call("now_ms")
            answer = self.call(name, *arguments)
            value = answer if tries == 0 else value
            shortest_ms = min(shortest_ms, elapsed_ms(self.call("now_ms"), begin_ms))
            if shortest_ms <= LONGEST_CALL_MS:
                return value
        self.breach(Phrase("check-takes-long", method=name, took_ms=shortest_ms))
        return value

    def answer(self, name: str, fits: "Callable[[Any], bool]", expected: str) -> "Any":
        """Return what the method gives; note a breach and return None where it raises or gives what doesn't fit.

        ``expected`` is the phrase "check-expects-…" that names what fits.
        """
        try:
            value = self.timed(name)
        except BoardFailedError:
            return None
        if fits(value):
            return value
        self.breach(
            Phrase("check-answer", method=name, value=brief(value), expected=Phrase(f"check-expects-{expected}"))
        )
        return None

    def act(self, name: str, *arguments: object) -> None:
        """Call a method that acts; note a breach where it raises or takes long."""
        try:
            self.timed(name, *arguments)
        except BoardFailedError:
            pass

    def wait(self, duration_ms: int) -> bool:
        """Let time pass; return False where the board's clock stands still. Raises BoardFailedError."""
        begin_ms = self.call("now_ms")
        if self._wait_ms is not None:
            self._wait_ms(duration_ms)
            return elapsed_ms(self.call("now_ms"), begin_ms) > 0
        return any(elapsed_ms(self.call("now_ms"), begin_ms) >= duration_ms for _ in range(_READS))


def brief(value: object) -> str:
    """Return ``value`` in a few characters."""
    if isinstance(value, (bytes, bytearray)) and len(value) > 8:
        return f"{len(value)} {type(value).__name__}"
    shown = repr(value)
    return shown if len(shown) <= _LONGEST_SHOWN else shown[:_LONGEST_SHOWN] + "..."


def is_count(value: "Any", most: int = 1 << 31) -> bool:
    """Return whether ``value`` is a whole number from 0 to ``most``, and no bool."""
    return type(value) is int and 0 <= value <= most
