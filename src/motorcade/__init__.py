"""Motorcade: program and drive small cars with 32-bit words.

The public names. Each is imported from its module on first use, so that a command
that needs none of them starts quickly.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from motorcade.car.check import check_board as check_board
    from motorcade.car.check.checked_board import BoardObserver as BoardObserver
    from motorcade.cli.run_tables import show as show
    from motorcade.config.profile import Profile as Profile
    from motorcade.config.profile import load_profile as load_profile
    from motorcade.drive.blocking_client import BlockingDriveClient as BlockingDriveClient
    from motorcade.drive.client import DriveClient as DriveClient
    from motorcade.engine.world import World as World
    from motorcade.errors import DriveError as DriveError
    from motorcade.errors import InputError as InputError
    from motorcade.errors import MatError as MatError
    from motorcade.errors import MotorcadeError as MotorcadeError
    from motorcade.errors import TransferError as TransferError
    from motorcade.mats import Mat as Mat
    from motorcade.mats import Physics as Physics
    from motorcade.mats import Pose as Pose
    from motorcade.mats import formation as formation
    from motorcade.mats import open_table as open_table
    from motorcade.mats import read_mat as read_mat
    from motorcade.program.compiler import Compiled as Compiled
    from motorcade.program.compiler import compile_program as compile_program
    from motorcade.program.conditions import chance as chance
    from motorcade.program.conditions import counter as counter
    from motorcade.program.conditions import dark as dark
    from motorcade.program.conditions import heard as heard
    from motorcade.program.conditions import obstacle as obstacle
    from motorcade.program.conditions import person as person
    from motorcade.program.decompiler import decompile as decompile
    from motorcade.program.diagnostics import ProgramError as ProgramError
    from motorcade.program.flow_steps import change_counter as change_counter
    from motorcade.program.flow_steps import do as do
    from motorcade.program.flow_steps import flow as flow
    from motorcade.program.flow_steps import forever as forever
    from motorcade.program.flow_steps import if_ as if_
    from motorcade.program.flow_steps import random as random
    from motorcade.program.flow_steps import repeat_until as repeat_until
    from motorcade.program.flow_steps import set_counter as set_counter
    from motorcade.program.flow_steps import tell as tell
    from motorcade.program.model import Followers as Followers
    from motorcade.program.model import Program as Program
    from motorcade.program.model import read_program as read_program
    from motorcade.runs.running import simulate as simulate
    from motorcade.words.field import WordError as WordError
    from motorcade.words.formats import CONTROL as CONTROL
    from motorcade.words.formats import DRIVE as DRIVE
    from motorcade.words.formats import FRAME as FRAME
    from motorcade.words.formats import HEADER as HEADER
    from motorcade.words.formats import LIGHTS as LIGHTS

# Written by scripts/generate.py from motorcade.devices; don't edit.
if TYPE_CHECKING:
    from motorcade.program.steps import avoid as avoid
    from motorcade.program.steps import floor as floor
    from motorcade.program.steps import follow_line as follow_line
    from motorcade.program.steps import forward as forward
    from motorcade.program.steps import led as led
    from motorcade.program.steps import left as left
    from motorcade.program.steps import pir as pir
    from motorcade.program.steps import repeat as repeat
    from motorcade.program.steps import right as right
    from motorcade.program.steps import together as together
    from motorcade.program.steps import turn_left_to_line as turn_left_to_line
    from motorcade.program.steps import turn_right_to_line as turn_right_to_line
    from motorcade.program.steps import voice as voice
    from motorcade.program.steps import wait as wait
    from motorcade.program.steps import wander as wander
# End of the section.

__version__ = "0.1.0"

_MODULES = {
    "motorcade.car.check": ("check_board",),
    "motorcade.car.check.checked_board": ("BoardObserver",),
    "motorcade.drive.blocking_client": ("BlockingDriveClient",),
    "motorcade.drive.client": ("DriveClient",),
    "motorcade.config.profile": ("Profile", "load_profile"),
    "motorcade.program.compiler": ("Compiled", "compile_program"),
    "motorcade.program.decompiler": ("decompile",),
    "motorcade.program.conditions": ("chance", "counter", "dark", "heard", "obstacle", "person"),
    "motorcade.program.diagnostics": ("ProgramError",),
    "motorcade.program.flow_steps": (
        "change_counter",
        "do",
        "flow",
        "forever",
        "if_",
        "random",
        "repeat_until",
        "set_counter",
        "tell",
    ),
    "motorcade.program.model": ("Followers", "Program", "read_program"),
    # Written by scripts/generate.py from motorcade.devices; don't edit.
    "motorcade.program.steps": (
        "avoid",
        "floor",
        "follow_line",
        "forward",
        "led",
        "left",
        "pir",
        "repeat",
        "right",
        "together",
        "turn_left_to_line",
        "turn_right_to_line",
        "voice",
        "wait",
        "wander",
    ),
    # End of the section.
    "motorcade.cli.run_tables": ("show",),
    "motorcade.mats": ("Mat", "Physics", "Pose", "formation", "open_table", "read_mat"),
    "motorcade.runs.running": ("simulate",),
    "motorcade.engine.world": ("World",),
    "motorcade.errors": ("DriveError", "InputError", "MatError", "MotorcadeError", "TransferError"),
    "motorcade.words.field": ("WordError",),
    "motorcade.words.formats": ("CONTROL", "DRIVE", "FRAME", "HEADER", "LIGHTS"),
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names}
__all__ = ["__version__", *sorted(_MODULE_OF)]


def __getattr__(name: str) -> object:
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'motorcade' has no attribute '{name}'")
    from motorcade.extras import needs_extra

    # Only what simulates needs more than Motorcade itself.
    with needs_extra("simulating", "world"):
        value = getattr(import_module(_MODULE_OF[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
