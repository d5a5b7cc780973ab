"""Call a board's methods, note what is wrong with their answers, and see by an observer what they did.

Portable.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable, Sequence
    from typing import Any

from motorcade.car.board import Board
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


class BoardObserver:
    """Shows what a board really did; a method that isn't overridden is something that nobody observes.

    No method may ask the board itself, since a mistake of the board would then show nowhere. None may wait.

    Attributes:
        within_ms: how late an output may be seen. An encoder sees a motor later than a mock pin sees its level.
        turns_on_the_spot: whether one wheel turns back while the car turns; False for a car that steers.
        leds: the LEDs that the car has.
    """

    within_ms = 100
    turns_on_the_spot = True
    leds: "Sequence[int]" = (0, 1, 2, 3)

    def wheels(self) -> "tuple[float, float] | None":
        """Return how fast the left and the right wheel turn now; None for a car without wheels.

        Positive is forward, 0 is still. Any unit will do, such as mm/s, percent of power or counts of an encoder.
        """
        return None

    def lit_leds(self) -> "Sequence[int]":
        """Return the numbers of the LEDs that are lit now."""
        return ()

    def sent_frames(self) -> "Sequence[int] | None":
        """Return the 32-bit frames that the emitter has sent since the last call; None for a car without emitter.

        A frame may be given when it begins or when it ends.
        """
        return None

    def written_bytes(self) -> bytes:
        """Return the bytes that left the serial line since the last call."""
        return b""

    def put_obstacle(self, distance_mm: int) -> "int | None":
        """Put an obstacle ``distance_mm`` ahead, or take it away for NOTHING_IN_SIGHT_MM.

        Returns:
            how far away the obstacle really is, in mm, and NOTHING_IN_SIGHT_MM for none; one that can't be moved stays
            where it is. None for a car without that sensor.
        """
        return None

    def show_carrier(self, is_on: bool) -> bool:
        """Switch the infrared of another car on or off at the receiver; return False for a car without receiver."""
        return False

    def show_person(self, is_there: bool) -> bool:
        """Let a person be near, or nobody; return False for a car without that sensor."""
        return False

    def speak(self, voice: int) -> bool:
        """Say a word, VOICE_STOP or VOICE_GO of `motorcade.car.brain`; return False for a car that can't hear."""
        return False

    def cut_power(self) -> None:
        """Throw away all that the store has not yet written for good, as a power failure does.

        ``reopen`` of `check_board` is called after it.
        """


class BrokenBoardError(Exception):
    """The board broke its contract, and the breach is noted: the check that found it ends."""


class Probe:
    """A board that is being checked.

    Args:
        wait_ms: lets that many milliseconds pass; None to watch the board's own clock.
        observer: shows what the board really did; None where nothing does.
        given: further arguments of `check_board` by their names; None for one that wasn't given.

    Attributes:
        breaches: what is wrong with it; ``str`` gives the sentence of each.
        missing: what wasn't given, so that a part of the board is not checked.
        method: the method that is checked now.
        clock_is_simulated: whether time passes only by ``wait_ms``.
    """

    def __init__(
        self,
        board: "Any",
        wait_ms: "Callable[[int], Any] | None" = None,
        observer: "BoardObserver | None" = None,
        **given: "Any",
    ) -> None:
        self.board = board
        self.observer = observer or BoardObserver()
        self.breaches: list[Phrase] = []
        self.missing: list[str] = []
        self.clock_is_simulated = wait_ms is not None
        self._wait_ms = wait_ms
        self._given = given
        self.method = ""

    def run(self, method: str, needs: str, check: "Callable[..., Any]", *arguments: "Any") -> bool:
        """Run the check of a method: ``check(probe, *arguments)``; return whether it found nothing wrong.

        It is not run where the board doesn't override the method, where the method is known to be broken, or where
        what it ``needs`` ("say", "observe.wheels") wasn't given, which is noted; that is the first of its arguments.
        """
        if method and not self.has_own(method):
            return True
        if needs:
            arguments = (self.offer(needs),) + arguments
        if (needs and arguments[0] is None) or (method and self.has_breach_of(method)):
            return True
        self.method = method
        count = len(self.breaches)
        try:
            check(self, *arguments)
        except BrokenBoardError:
            pass
        return len(self.breaches) == count

    def breach(self, key: str, **details: "Any") -> None:
        """Note what is wrong, once. Details name the method that is checked now, unless they name another."""
        if self.method:
            details.setdefault("method", self.method)
        breach = Phrase(key, **details)
        if breach not in self.breaches:
            self.breaches.append(breach)

    def require(self, is_right: "Any", key: str, **details: "Any") -> None:
        """Note what is wrong, and end the check, unless ``is_right``. Raises BrokenBoardError."""
        if not is_right:
            self.breach(key, **details)
            raise BrokenBoardError

    def has_breach_of(self, method: str) -> bool:
        """Return whether a breach of that method is noted already; another one would not help the board's author."""
        return any(breach.details.get("method") == method for breach in self.breaches)

    def has_own(self, method: str) -> bool:
        """Return whether the board overrides that method of Board; otherwise it hasn't the hardware for it."""
        return getattr(type(self.board), method, None) is not getattr(Board, method)

    def offer(self, needs: str) -> "Any":
        """Return an argument of check_board ("say") or a method of the observer ("observe.wheels").

        None where it wasn't given, or where nobody observes that, which is noted.
        """
        _, _, shown = needs.partition(".")
        if shown:
            own = getattr(type(self.observer), shown, None)
            found = None if own in (None, getattr(BoardObserver, shown)) else getattr(self.observer, shown)
        else:
            found = self._given.get(needs)
        if found is None and needs not in self.missing:
            self.missing.append(needs)
        return found

    def see(
        self, read: "Callable[[], Any]", fits: "Callable[[Any], bool]", within_ms: int, late: str, **details: "Any"
    ) -> "Any":
        """Read until the reading fits and return it; the last one where none does within a second.

        It is a breach (``late``) if that takes longer than ``within_ms``. Raises BrokenBoardError.
        """
        late_ms, value = self.settle(read, fits)
        self.require(late_ms is None or late_ms <= within_ms, late, after_ms=late_ms, within_ms=within_ms, **details)
        return value

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
        """Call the board's method and return its result. Raises BrokenBoardError."""
        return self.call_of(self.board, name, *arguments)

    def call_of(self, board: "Any", name: str, *arguments: object) -> "Any":
        """Call a method of another board of its kind. Raises BrokenBoardError."""
        try:
            return getattr(board, name)(*arguments)
        except Exception as problem:  # noqa: BLE001 - the board's author has to see any error
            shown = ", ".join([brief(argument) for argument in arguments])
            error = f"{type(problem).__name__}: {problem}"
        self.breach("check-raised", method=name, arguments=shown, error=error)
        raise BrokenBoardError

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
        self.breach("check-takes-long", method=name, took_ms=shortest_ms)
        return value

    def answer(self, name: str, fits: "Callable[[Any], bool]", expected: str) -> "Any":
        """Return what the method gives; it is a breach if that doesn't fit, or takes long. Raises BrokenBoardError.

        ``expected`` is the phrase "check-expects-…" that names what fits.
        """
        return self.fitting(name, self.timed(name), fits, expected)

    def fitting(self, name: str, value: "Any", fits: "Callable[[Any], bool]", expected: str) -> "Any":
        """Return ``value``, which the method gave; it is a breach if it doesn't fit. Raises BrokenBoardError."""
        wanted = Phrase(f"check-expects-{expected}")
        self.require(fits(value), "check-answer", method=name, value=brief(value), expected=wanted)
        return value

    def wait(self, duration_ms: int) -> bool:
        """Let time pass; return False where the board's clock stands still. Raises BrokenBoardError."""
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
