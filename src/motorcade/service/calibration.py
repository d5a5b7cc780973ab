"""The moves by which a car is measured, as images; and the answers to what was read of them."""

from motorcade.config.calibration import Move
from motorcade.config.profile import Profile
from motorcade.program.compiler import compile_program
from motorcade.program.flow_steps import forever
from motorcade.program.model import Program
from motorcade.program.steps import DriveStep, LedStep, WaitStep

# Time to unplug the car and to step back; then its lamp says that it is about to drive.
UNPLUG_S = 9
LAMP_S = 3


def move_image(move: Move, profile: Profile) -> bytes:
    """Return the image of a car that makes a move once, after UNPLUG_S and LAMP_S, and again after each reset.

    Raises MotorcadeError where the profile has no such times.
    """
    steps = [
        WaitStep(UNPLUG_S),
        LedStep(which=0, seconds=LAMP_S),
        DriveStep(move.direction, move.level, move.seconds),
        forever(WaitStep(1)),
    ]
    return compile_program(Program(steps, profile=profile.name), profile).image
