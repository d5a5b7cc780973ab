"""`motorcade` on a Raspberry Pi whose pins are gpiozero's mock ones; run by test_serve_real_car.py and others.

``noted_pi_car.py FILE ARGUMENTS``: what its pins show is appended to FILE, such as ``GPIO12 255``; and ``rescued 0`` by
the guard of `motorcade car run`, where it had to stop the wheels.
"""

import os
import sys
from dataclasses import replace
from pathlib import Path
from unittest import mock

from gpiozero.pins.mock import MockFactory, MockPWMPin

from motorcade.boards.linux import raspberry_pi
from motorcade.cli import main
from motorcade.config import profile

FILE = Path(sys.argv.pop(1))
CLASSROOM = profile.built_in_profile("classroom")
PATIENT = replace(CLASSROOM.drive, watchdog_ms=30_000, failsafe_ms=40_000, hand_over_ms=60_000)


# For the guard, a process of its own.
os.environ["PYTHONPATH"] = os.pathsep.join([str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")])


class NotedPin(MockPWMPin):
    """A pin that writes each change to FILE."""

    def _change_state(self, value):
        changed = super()._change_state(value)
        if changed:
            with FILE.open("a", encoding="ascii") as notes:
                notes.write(f"{self.info.name} {float(value) * 255:.0f}\n")
        return changed


with (
    mock.patch.object(raspberry_pi, "open_gpio", return_value=MockFactory(pin_class=NotedPin)),
    mock.patch.object(raspberry_pi, "rescue_call", return_value=("support.guarded_car:note_rescue", (str(FILE),))),
    # On a busy machine a driver may be late for longer than a profile allows.
    mock.patch.object(profile, "load_profile", return_value=replace(CLASSROOM, drive=PATIENT)),
):
    main()
