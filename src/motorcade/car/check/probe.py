"""Calls a board's methods and notes what is wrong with their answers.

Portable.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable
    from typing import Any

from motorcade.words.ticks import TICKS_MASK, elapsed_ms

# A car ticks every few milliseconds: no call of its board may take much longer.
LONGEST_CALL_MS = 20
_TRIES = 3
# So often a clock is read before it counts as one that stands still: some seconds on a microcontroller.
_READS = 200000
_LONGEST_SHOWN = 60


class BoardFailedError(Exception):
    """A call of the board raised, or took other arguments; the breach is noted already."""


class Probe:
    """A board that is being checked.

    Args:
        board: the board.
        wait_ms: lets so many milliseconds pass, None where the board's own clock tells.

    Attributes:
        breaches: what is wrong with it, a sentence each.
        clock_is_simulated: whether time passes only by ``wait_ms``.
    """

    def __init__(self, board: "Any", wait_ms: "Callable[[int], Any] | None") -> None:
        self.board = board
        self.breaches: list[str] = []
        self.clock_is_simulated = wait_ms is not None
        self._wait_ms = wait_ms

    def breach(self, sentence: str) -> None:
        """Note what is wrong, once."""
        if sentence not in self.breaches:
            self.breaches.append(sentence)

    def blames(self, name: str) -> bool:
        """Whether a breach of that method is noted: more of the same would tell its author nothing."""
        return any(sentence.startswith(name) for sentence in self.breaches)

    def call(self, name: str, *arguments: object) -> "Any":
        """What the board's method gives. Raises BoardFailedError."""
        return self.call_of(self.board, name, *arguments)

    def call_of(self, board: "Any", name: str, *arguments: object) -> "Any":
        """The same for another board of its kind."""
        try:
            return getattr(board, name)(*arguments)
        except Exception as problem:  # noqa: BLE001 - whatever it is, the board's author has to know
            shown = ", ".join([brief(argument) for argument in arguments])
            self.breach(f"{name}({shown}) raised {type(problem).__name__}: {problem}")
        raise BoardFailedError

    def timed(self, name: str, *arguments: object) -> "Any":
        """The same; a method that takes long each time it is tried is a breach."""
        shortest_ms, value = TICKS_MASK, None
        for tries in range(_TRIES):
            begin_ms = self.call("now_ms")
            answer = self.call(name, *arguments)
            value = answer if tries == 0 else value
            shortest_ms = min(shortest_ms, elapsed_ms(self.call("now_ms"), begin_ms))
            if shortest_ms <= LONGEST_CALL_MS:
                return value
        self.breach(f"{name} took {shortest_ms} ms; it must never wait, for a car ticks every few milliseconds")
        return value

    def answer(self, name: str, fits: "Callable[[Any], bool]", expected: str) -> "Any":
        """What the method gives; None where it raises, or gives what doesn't fit, which is noted."""
        try:
            value = self.timed(name)
        except BoardFailedError:
            return None
        if fits(value):
            return value
        self.breach(f"{name}() gave {brief(value)}; it has to give {expected}")
        return None

    def act(self, name: str, *arguments: object) -> None:
        """Let the board do something; where it raises or takes long, that is noted."""
        try:
            self.timed(name, *arguments)
        except BoardFailedError:
            pass

    def wait(self, duration_ms: int) -> bool:
        """Let time pass; False where the board's clock stands still meanwhile. Raises BoardFailedError."""
        begin_ms = self.call("now_ms")
        if self._wait_ms is not None:
            self._wait_ms(duration_ms)
            return elapsed_ms(self.call("now_ms"), begin_ms) > 0
        return any(elapsed_ms(self.call("now_ms"), begin_ms) >= duration_ms for _ in range(_READS))


def brief(value: object) -> str:
    """``value`` in a few characters."""
    if isinstance(value, (bytes, bytearray)) and len(value) > 8:
        return f"{len(value)} {type(value).__name__}"
    shown = repr(value)
    return shown if len(shown) <= _LONGEST_SHOWN else shown[:_LONGEST_SHOWN] + "..."


def is_count(value: "Any", most: int = 1 << 31) -> bool:
    """Whether ``value`` is a whole number from 0 to ``most``, and no bool."""
    return type(value) is int and 0 <= value <= most
