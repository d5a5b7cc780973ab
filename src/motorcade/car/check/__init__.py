"""Check that a board keeps the contract of `motorcade.car.board`; for authors of boards for other hardware.

One loop goes over the table of `motorcade.car.check.devices`, which says what is probed. Portable: it runs on the board
itself too. Lift the wheels off the ground first.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable
    from typing import Any

from motorcade.car.check.checked_board import (
    LONGEST_CALL_MS,
    BoardObserver,
    CheckedBoard,
    Probe,
    brief,
)
from motorcade.car.check.devices import ATTRIBUTES, PROBES, check_levels
from motorcade.car.check.signals import check_clock
from motorcade.errors import Phrase
from motorcade.words.ticks import elapsed_ms

# The key of the phrase that names what was not checked.
NOT_CHECKED = "check-not-checked"
METHODS: "tuple[str, ...]" = tuple([probe.method for probe in PROBES])
# A method pauses if it does so in that many rounds of calls, while the computer itself does not.
_PAUSES = 4
_ROUNDS = 8
_TRIES = 3
# An output goes on until the next call; watchdogs of motor drivers end it sooner.
_LASTS_MS = 1000


def check_board(
    board: "Any",
    reopen: "Callable[[], Any] | None" = None,
    wait_ms: "Callable[[int], Any] | None" = None,
    hear: "Callable[[int], Any] | None" = None,
    say: "Callable[[bytes], Any] | None" = None,
    observe: "BoardObserver | None" = None,
) -> list[Phrase]:
    """Return what breaks the contract of a board, and what could not be checked; ``str`` makes sentences of them.

    The wheels turn briefly, LEDs flash, frames are sent, and images are stored. At the end the image that was there
    before is stored again (the empty one where there was none).

    Args:
        board: as it would be given to `motorcade.car.loop.Car`.
        reopen: makes a new board on the same store, as switching it off and on does. Images are then read from the
            new board, which shows what is left after a power cut. With None they are read from ``board``.
        wait_ms: lets that many milliseconds pass; needed where the board's clock is simulated.
        hear: sends an infrared frame (32 bits) to the board, for example with a second car; None where nothing can.
        say: sends bytes to the board's serial line, up to 230 at once; None where nothing can.
        observe: shows what the board's outputs really did, and shows things to its sensors; None where nothing does.

    Returns:
        A phrase for each mistake. Where something that the board has was not checked, the last phrase has the key
        NOT_CHECKED and names what was not given. An empty list says that all was checked and nothing is wrong.
    """
    gives = {probe.method: probe.gives for probe in PROBES}
    checked = CheckedBoard(board, gives, wait_ms, observe, reopen=reopen, hear=hear, say=say)
    for name, fits, key in ATTRIBUTES:
        value = getattr(board, name, None)
        checked.run(name, CheckedBoard.require, fits(value), key, name=name, value=brief(value))
    checked.run("levels", check_levels)
    for method in METHODS:
        checked.run(method, CheckedBoard.require, callable(getattr(board, method, None)), "check-no-method")
    checked.run("now_ms", check_clock)
    if not checked.has_breach_of(*METHODS):
        for probe in PROBES:
            # All else is timed by this clock.
            if checked.has_own(probe.method) and not checked.has_breach_of("now_ms"):
                _check(checked, probe)
    if checked.missing:
        checked.breaches.append(Phrase(NOT_CHECKED, parts=", ".join(checked.missing)))
    return checked.breaches


def _check(checked: CheckedBoard, probe: Probe) -> None:
    """Check a method until something is found wrong: one fault gives one sentence."""
    if probe.takes:
        checked.run(probe.method, _check_calls, probe)
    checks = probe.checks
    if probe.needs:
        checks += ((probe.needs, _watch, probe),)
    for needs, check, *arguments in checks:
        if needs:
            given = checked.offer(needs)
            if given is None:
                continue
            arguments.insert(0, given)
        checked.run(probe.method, check, *arguments)


def _check_calls(checked: CheckedBoard, probe: Probe) -> None:
    """Note a method that doesn't take every value, gives a wrong type, or takes long in some of its calls."""
    try:
        pauses = 0
        for _ in range(_ROUNDS):
            began_ms, took_ms = checked.call("now_ms"), _longest_ms(checked, probe)
            if took_ms <= LONGEST_CALL_MS:
                return
            pauses += not _computer_pauses(checked, elapsed_ms(checked.call("now_ms"), began_ms))
            checked.require(pauses < _PAUSES, "check-pauses", took_ms=took_ms, calls=probe.calls)
    finally:
        if not probe.gives:
            # The last value stops wheels.
            checked.prepare(probe.method)
            checked.call(probe.method, *probe.takes[-1])


def _longest_ms(checked: CheckedBoard, probe: Probe) -> int:
    """Return how long the longest of many calls takes. Where the first ones all take long, all do."""
    took_ms: list[int] = []
    for place in range(probe.calls):
        checked.prepare(probe.method)
        began_ms = checked.call("now_ms")
        checked.call(probe.method, *probe.takes[place % len(probe.takes)])
        took_ms.append(elapsed_ms(checked.call("now_ms"), began_ms))
        if place == _TRIES:
            checked.require(min(took_ms) <= LONGEST_CALL_MS, "check-takes-long", took_ms=min(took_ms))
    return max(took_ms)


def _computer_pauses(checked: CheckedBoard, duration_ms: int) -> bool:
    """Return whether the time jumps within ``duration_ms`` though the board is asked for nothing but the time."""
    began_ms = before_ms = checked.call("now_ms")
    while not checked.clock_is_simulated and elapsed_ms(before_ms, began_ms) < duration_ms:
        now_ms = checked.call("now_ms")
        if elapsed_ms(now_ms, before_ms) > LONGEST_CALL_MS:
            return True
        before_ms = now_ms
    return False


def _watch(checked: CheckedBoard, shown: "Callable[..., Any]", probe: Probe) -> None:
    """Do or show each step of a probe, and note what is not seen then, is seen late, or doesn't last."""

    def call(*arguments: "Any") -> "Any":
        checked.prepare(probe.method)
        return checked.call(probe.method, *arguments)

    do, see = call, shown
    if probe.gives:
        do, see = shown, call
    elif see() is None:
        # The car hasn't what the observer would look at.
        return
    seen_at: list[tuple[Any, Any]] = []
    if probe.comes_once:
        # What was sent before may come late.
        checked.wait(_LASTS_MS)
    try:
        for step in probe.steps:
            read = see
            if probe.comes_once:
                # What came before is taken away.
                read = _collecting(see)
            real = do(*_as_arguments(step))
            if probe.gives and probe.needs != "hear":
                if real is None or real is False:
                    return
                if real is not True:
                    step = real
            # A frame may be seen when it has ended.
            checked.prepare(probe.method)
            seen_at.append((step, _seen_at(checked, probe, step, read, not seen_at)))
        if probe.compare is not None:
            probe.compare(checked, seen_at)
    finally:
        if not probe.comes_once:
            do(*_as_arguments(probe.steps[-1]))


def _as_arguments(step: "Any") -> "tuple[Any, ...]":
    if isinstance(step, tuple):
        return step
    return (step,)


def _seen_at(checked: CheckedBoard, probe: Probe, step: "Any", read: "Callable[[], Any]", is_first: bool) -> "Any":
    """Return what is seen after a step. Raises BrokenBoardError where that is wrong, late, or doesn't last."""
    within_ms = checked.observer.within_ms
    if probe.gives:
        within_ms = probe.within_ms

    def fault(seen: "Any") -> str:
        return probe.fault(checked.observer, step, seen)

    def require(key: str) -> None:
        details = {"asked": step, "seen": probe.shown(seen), "after_ms": late_ms, "within_ms": within_ms}
        checked.require(not key, key, **details)

    late_ms, seen = checked.settle(read, lambda seen: not fault(seen))
    require(fault(seen))
    if late_ms > within_ms:
        require(probe.late or probe.sentences[step])
    lasts_ms = within_ms
    if probe.gives and not probe.comes_once:
        lasts_ms = 0
    elif is_first:
        lasts_ms = _LASTS_MS
    for _ in range(lasts_ms // LONGEST_CALL_MS):
        checked.wait(LONGEST_CALL_MS)
        seen = read()
    require(fault(seen) and (probe.changes or fault(seen)))
    return seen


def _collecting(take: "Callable[[], Any]") -> "Callable[[], list[Any]]":
    """Return a function that gives all that ``take`` has given from now on."""
    take()
    taken: list[Any] = []

    def read() -> "list[Any]":
        new = take()
        if isinstance(new, (list, tuple)):
            taken.extend(new)
        elif new:
            taken.append(new)
        return taken

    return read
