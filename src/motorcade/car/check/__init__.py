"""Check that a board keeps the contract of `motorcade.car.board`; for authors of boards for other hardware.

Portable: it runs on the board itself too. Lift the wheels off the ground first.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable
    from typing import Any

from motorcade.car.check.calls import CALLED, PAUSES, check_attributes, check_methods
from motorcade.car.check.clock import check_clock
from motorcade.car.check.line import check_reading, check_writing
from motorcade.car.check.probe import BoardObserver, Probe
from motorcade.car.check.seen import SEEN
from motorcade.car.check.store import check_store
from motorcade.errors import Phrase

# The key of the phrase that names what was not checked.
NOT_CHECKED = "check-not-checked"
# The method that is checked, what that needs, the check, and further arguments of it. Once a check has found a method
# broken, it is checked no more: one fault gives one sentence.
CHECKS: "tuple[tuple[Any, ...], ...]" = (
    CALLED
    + (("read_serial", "say", check_reading), ("write_serial", "observe.written_bytes", check_writing))
    + SEEN
    + (("read_serial", "say", check_reading, True), ("write_serial", "observe.written_bytes", check_writing, True))
    + PAUSES
    + (("store_image", "", check_store),)
)


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
    probe = Probe(board, wait_ms, observe, reopen=reopen, hear=hear, say=say)
    probe.run("", "", check_attributes)
    if probe.run("", "", check_methods) and probe.run("", "", check_clock):
        for method, needs, check, *arguments in CHECKS:
            # A leader receives nothing.
            if needs != "hear" or hear is not None or not board.is_leader:
                probe.run(method, needs, check, *arguments)
    if probe.missing:
        probe.breaches.append(Phrase(NOT_CHECKED, parts=", ".join(probe.missing)))
    return probe.breaches
