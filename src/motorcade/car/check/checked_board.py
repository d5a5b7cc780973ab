"""A board that is being checked, who observes it, and what a probe of it says.

Portable.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable, Sequence
    from typing import Any

from motorcade.car.board import Board
from motorcade.car.brain import VOICE_GO
from motorcade.errors import Phrase
from motorcade.words.ticks import elapsed_ms
from motorcade.words.upload import IMAGE, SILENCE_MS, CarEnd

# A car ticks every few milliseconds: no call of its board may take much longer.
LONGEST_CALL_MS = 20
# So long a reading may take to fit at all.
GIVES_UP_MS = 1000
_STEP_MS = 5
# A clock that doesn't change in so many readings stands still; they take some seconds on a microcontroller.
_READS = 200000
_LONGEST_SHOWN = 60


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

    def show_floor(self, dark: int) -> bool:
        """Put dark floor under the left sensor (1), the right one (2), both (3) or none; return False without them."""
        return False

    def speak(self, voice: int) -> bool:
        """Say a word, VOICE_STOP or VOICE_GO of `motorcade.car.brain`; return False for a car that can't hear."""
        return False

    def cut_power(self) -> None:
        """Throw away all that the store has not yet written for good, as a power failure does.

        ``reopen`` of `check_board` is called after it.
        """


class Probe:
    """What is checked of one method of a board: a row of `motorcade.car.check.devices`.

    Args:
        method: its name.
        row: the attributes that differ from those that stand here.

    Attributes:
        gives: what it returns: a key of EXPECTED; empty for an output.
        takes: arguments for each of some calls; the last ones leave wheels still and LEDs dark.
        calls: how many calls show whether it pauses.
        needs: what shows that it does what it should: "observe.wheels", or "hear". Where the method gives something,
            that is called with each step, and the method has to give what fits; otherwise the method is called with
            each step, and that has to show what fits.
        steps: what is shown or asked, one after another; the last one leaves the board still.
        sentences: of a sensor that says True or False: the keys where it doesn't say the step False or True, or late.
        fault: (observer, step, seen) returns the key of what is wrong with what is seen, "" where that is right.
        late: the key where that is seen too late.
        changes: the key where it doesn't last until the next step.
        within_ms: how late a sensor may be; what is older no longer helps a car that drives.
        comes_once: whether ``seen`` is the list of all that came since the step, not what is there at a moment.
        shown: makes of what is seen a detail of the sentence.
        compare: (checked, [(step, seen), ...]) notes what is wrong with all steps together.
        checks: further checks: (what it needs, function, arguments...). The function gets the CheckedBoard, what it
            needs, and the arguments.
    """

    gives = ""
    takes: "tuple[tuple[Any, ...], ...]" = ((),)
    calls = 120
    needs = ""
    steps: "tuple[Any, ...]" = ()
    sentences = ("", "")
    late = ""
    changes = ""
    within_ms = 500
    comes_once = False
    compare: "Callable[[CheckedBoard, list[tuple[Any, Any]]], None] | None" = None
    checks: "tuple[tuple[Any, ...], ...]" = ()

    def __init__(self, method: str, **row: "Any") -> None:
        self.method = method
        for name, value in row.items():
            setattr(self, name, value)

    def fault(self, observer: "BoardObserver", step: "Any", seen: "Any") -> str:
        """Return the sentence of a sensor that doesn't say the step, "" where it does."""
        return "" if bool(seen) == step else self.sentences[step]

    def shown(self, seen: "Any") -> "Any":
        """Return what is seen."""
        return seen


class BrokenBoardError(Exception):
    """The board broke its contract, and the breach is noted: the check that found it ends."""


class CheckedBoard:
    """A board that is being checked.

    Args:
        gives: what each method returns: keys of EXPECTED by the methods' names.
        wait_ms: lets that many milliseconds pass; None to watch the board's own clock.
        observer: shows what the board really did; None where nothing does.
        given: further arguments of `check_board` by their names; None for one that wasn't given.

    Attributes:
        breaches: what is wrong with it; ``str`` gives the sentence of each.
        missing: what wasn't given, so that a part of the board is not checked.
        clock_is_simulated: whether time passes only by ``wait_ms``.
    """

    def __init__(
        self,
        board: "Any",
        gives: "dict[str, str]",
        wait_ms: "Callable[[int], Any] | None",
        observer: "BoardObserver | None",
        **given: "Any",
    ) -> None:
        self.board = board
        self.observer = observer or BoardObserver()
        self.breaches: list[Phrase] = []
        self.missing: list[str] = []
        self.clock_is_simulated = wait_ms is not None
        self._gives = gives
        self._wait_ms = wait_ms
        self._given = given
        self._method = ""

    def run(self, method: str, check: "Callable[..., Any]", *arguments: "Any", **details: "Any") -> None:
        """Run a check of the method, ``check(self, *arguments, **details)``, unless that is known to be broken."""
        self._method = method
        if not self.has_breach_of(method):
            try:
                check(self, *arguments, **details)
            except BrokenBoardError:
                pass

    def require(self, is_right: "Any", key: str, **details: "Any") -> None:
        """Note what is wrong, once, and end the check, unless ``is_right``. Raises BrokenBoardError.

        Details name the method that is checked now, unless they name another.
        """
        if not is_right:
            details.setdefault("method", self._method)
            breach = Phrase(key, **details)
            if breach not in self.breaches:
                self.breaches.append(breach)
            raise BrokenBoardError

    def has_breach_of(self, *methods: str) -> bool:
        """Return whether a breach of a method is noted already; another one would not help the board's author."""
        return any(breach.details["method"] in methods for breach in self.breaches)

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
        # A leader receives nothing.
        if found is None and needs not in self.missing and not (needs == "hear" and self.board.is_leader):
            self.missing.append(needs)
        return found

    def prepare(self, method: str) -> None:
        """Do what a car does before it calls the method: wait for a frame's end, and look for frames."""
        if method == "send_frame":
            self.settle(lambda: not self.call("is_sending"))
        if method == "senses_carrier":
            # Some boards look at their receiver's edges only here.
            self.call("received_frames")

    def call(self, method: str, *arguments: object) -> "Any":
        """Call the board's method, and return its result, which has to be what EXPECTED says.

        Raises BrokenBoardError.
        """
        value = self.call_of(self.board, method, *arguments)
        expected = self._gives[method]
        if expected and not EXPECTED[expected](value):
            wanted = Phrase(f"check-expects-{expected}")
            self.require(False, "check-answer", method=method, value=brief(value), expected=wanted)
        return value

    def call_of(self, board: "Any", method: str, *arguments: object) -> "Any":
        """Call a method of another board of its kind, and return any result. Raises BrokenBoardError."""
        try:
            return getattr(board, method)(*arguments)
        except Exception as problem:  # noqa: BLE001 - the board's author has to see any error
            error = f"{type(problem).__name__}: {problem}"
        shown = ", ".join([brief(argument) for argument in arguments])
        return self.require(False, "check-raised", method=method, arguments=shown, error=error)

    def settle(
        self, read: "Callable[[], Any]", fits: "Callable[[Any], bool]" = lambda value: bool(value)
    ) -> "tuple[int, Any]":
        """Read until the reading fits, for at most a second.

        Returns:
            after how many ms a reading still didn't fit (0: the first one did); and the last one.
        """
        begin_ms, late_ms = self.call("now_ms"), 0
        while True:
            read_ms = elapsed_ms(self.call("now_ms"), begin_ms)
            value = read()
            if fits(value) or late_ms >= GIVES_UP_MS:
                return late_ms, value
            late_ms = read_ms
            self.wait(_STEP_MS)

    def wait(self, duration_ms: int) -> bool:
        """Let time pass; return False where the board's clock stands still. Raises BrokenBoardError."""
        begin_ms = self.call("now_ms")
        if self._wait_ms is not None:
            self._wait_ms(duration_ms)
            return elapsed_ms(self.call("now_ms"), begin_ms) > 0
        return any(elapsed_ms(self.call("now_ms"), begin_ms) >= duration_ms for _ in range(_READS))


def with_others(module: "Any", functions: "dict[str, Any]", action: "Callable[[], Any]") -> "Any":
    """Return what ``action`` gives while a module has other functions."""
    originals = {name: getattr(module, name) for name in functions}
    try:
        for name, function in functions.items():
            setattr(module, name, function)
        return action()
    finally:
        for name, function in originals.items():
            setattr(module, name, function)


def brief(value: object) -> str:
    """Return ``value`` in a few characters."""
    if isinstance(value, (bytes, bytearray)) and len(value) > 8:
        return f"{len(value)} {type(value).__name__}"
    shown = repr(value)
    return shown if len(shown) <= _LONGEST_SHOWN else shown[:_LONGEST_SHOWN] + "..."


def is_count(value: "Any", most: int = 1 << 31) -> bool:
    """Return whether ``value`` is a whole number from 0 to ``most``, and no bool."""
    return type(value) is int and 0 <= value <= most


def _is_image(value: bytes) -> bool:
    """Return whether a car would take these bytes, and no more and no fewer, as an image."""
    car_end = CarEnd()
    car_end.receive_data(value, 0)
    # The empty image ends by silence.
    car_end.receive_data(b"", SILENCE_MS)
    event = car_end.next_event()
    return event is not None and event.kind == IMAGE and event.image == value


# What a method may give, by the phrase "check-expects-…" that names it.
EXPECTED: "dict[str, Callable[[Any], bool]]" = {
    "bool": lambda value: type(value) in (bool, int) and value in (0, 1),
    "bytes": lambda value: type(value) is bytes,
    "frames": lambda value: isinstance(value, (list, tuple)) and all(is_count(frame, 0xFFFFFFFF) for frame in value),
    "image": lambda value: value is None or (type(value) is bytes and _is_image(value)),
    "millimetres": is_count,
    "milliseconds": lambda value: type(value) is int,
    "floor": lambda value: is_count(value, 3),
    "voice": lambda value: is_count(value, VOICE_GO),
}
