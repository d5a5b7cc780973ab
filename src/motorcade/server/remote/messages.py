"""What a remote's page says, in JSON: sticks are axes, and what becomes of them is Python's."""

from typing import Annotated

from msgspec import Meta, Struct

Name = Annotated[str, Meta(max_length=40)]
Axis = Annotated[float, Meta(ge=-1, le=1)]


class _Message(Struct, tag_field="do", tag=str.lower, forbid_unknown_fields=True):
    pass


class Sit(_Message):
    """Take a seat at a car, to watch or to drive."""

    car: Name


class Leave(_Message):
    """Be gone from a car."""

    car: Name


class DriveMessage(_Message, tag="drive"):
    """Where the stick is now, for all of these cars.

    ``throttle`` is -1 full speed back to 1 full speed ahead, ``steering`` -1 full left to 1 full right, ``number`` the
    page's own count, which comes back at once.
    """

    cars: Annotated[list[Name], Meta(max_length=16)]
    throttle: Axis
    steering: Axis
    number: Annotated[int, Meta(ge=0, lt=1 << 53)] = 0


class Request(_Message):
    """Ask for the wheel."""

    car: Name


class Release(_Message):
    """Give the wheel back."""

    car: Name


class Stop(_Message):
    """Emergency stop of all of these cars."""

    cars: Annotated[list[Name], Meta(max_length=16)]


class Clear(_Message):
    """Lift the emergency stop."""

    car: Name


class Resume(_Message):
    """Let the car's own program drive again."""

    car: Name


class Start(_Message):
    """Let time go on where the cars live in a world that stands still."""


Message = Sit | Leave | DriveMessage | Request | Release | Stop | Clear | Resume | Start
