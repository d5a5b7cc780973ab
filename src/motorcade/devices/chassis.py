"""The chassis of a car that somebody drives: a steering servo and a drive motor."""

from motorcade.devices.declaration import Device, Part, Role
from motorcade.devices.motor import wheel_motor

CHASSIS = Device(
    "chassis",
    parts=(
        Part("servo", "5 V, GND", (Role("signal", True, "SIG"),)),
        wheel_motor("drive_motor", ("IN1", "IN2", "ENA")),
    ),
)
