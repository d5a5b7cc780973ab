"""Check that a board keeps the contract of `motorcade.car.board`; for authors of boards for other hardware.

Portable: it runs on the board itself too. Lift the wheels off the ground first.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable
    from typing import Any

from motorcade.car.check.clock import check_clock
from motorcade.car.check.parts import (
    check_actuators,
    check_attributes,
    check_hearing,
    check_line,
    check_methods,
    check_sending,
    check_sensors,
)
from motorcade.car.check.probe import Probe
from motorcade.car.check.store import check_store
from motorcade.errors import Phrase


def check_board(
    board: "Any",
    reopen: "Callable[[], Any] | None" = None,
    wait_ms: "Callable[[int], Any] | None" = None,
    hear: "Callable[[int], Any] | None" = None,
    say: "Callable[[bytes], Any] | None" = None,
) -> list[Phrase]:
    """Return what breaks the contract of a board, an empty list where nothing does; ``str`` makes sentences of them.

    The wheels turn briefly, LEDs flash, a frame is sent, and images are stored. At the end the image that was
    there before is stored again (the empty one where there was none).

    Args:
        board: as it would be given to `motorcade.car.loop.Car`.
        reopen: makes a new board on the same store, as switching it off and on does. Images are then read from the
            new board, which shows what is left after a power cut. With None they are read from ``board``.
        wait_ms: lets that many milliseconds pass; needed where the board's clock is simulated.
        hear: sends an infrared frame (32 bits) to the board, for example with a second car; None where nothing can.
        say: sends bytes to the board's serial line; None where nothing can.
    """
    probe = Probe(board, wait_ms)
    levels_fit = check_attributes(probe)
    if not check_methods(probe) or not check_clock(probe):
        return probe.breaches
    check_sensors(probe)
    check_line(probe, say)
    check_actuators(probe)
    if levels_fit:
        check_sending(probe)
    if hear is not None:
        check_hearing(probe, hear)
    check_store(probe, reopen)
    return probe.breaches
