"""Check that a board keeps the contract of `motorcade.car.board`; for authors of boards for other hardware.

Portable: it runs on the board itself too. Lift the wheels off the ground first.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable
    from typing import Any

from motorcade.car.check.clock import check_clock
from motorcade.car.check.inputs import check_inputs
from motorcade.car.check.line import check_line, check_line_while_sending
from motorcade.car.check.observer import BoardObserver
from motorcade.car.check.outputs import check_leds, check_sent, check_wheels
from motorcade.car.check.parts import (
    check_actuators,
    check_attributes,
    check_hearing,
    check_methods,
    check_pauses,
    check_sending,
    check_sensors,
)
from motorcade.car.check.probe import Probe
from motorcade.car.check.store import check_store
from motorcade.errors import Phrase

# The key of the phrase that names what was not checked.
NOT_CHECKED = "check-not-checked"


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
    probe = Probe(board, wait_ms, observe)
    levels_fit = check_attributes(probe)
    if not check_methods(probe) or not check_clock(probe):
        return probe.breaches
    check_sensors(probe)
    check_line(probe, say)
    check_actuators(probe)
    check_wheels(probe)
    check_leds(probe)
    check_inputs(probe)
    if levels_fit:
        check_sending(probe)
        check_sent(probe)
        check_line_while_sending(probe, say)
    check_hearing(probe, hear)
    check_pauses(probe)
    check_store(probe, reopen)
    if probe.missing:
        probe.breach(Phrase(NOT_CHECKED, parts=", ".join(probe.missing)))
    return probe.breaches
