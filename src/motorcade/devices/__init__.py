"""What a car has: each device is declared in one module, as data."""

from motorcade.devices.declaration import LEVELS, THRESHOLD, Device, Option, Part, Role
from motorcade.devices.floor import FLOOR
from motorcade.devices.infrared import INFRARED
from motorcade.devices.led import LED
from motorcade.devices.motor import CHASSIS, MOTOR
from motorcade.devices.pir import PIR
from motorcade.devices.ultrasonic import ULTRASONIC
from motorcade.devices.voice import VOICE

# The line that programs come by.
SERIAL_LINE = Device(
    "serial",
    parts=(Part("serial", "GND", (Role("transmit", True, "RX"), Role("receive", False, "TX"))),),
)

# Whoever holds it while the power comes on chooses a leader; without it the car follows.
BUTTON = Device(
    "button",
    parts=(
        Part(
            "button",
            "GND",
            (Role("signal", False, "SIG"),),
            options=(Option("pressed", "low", LEVELS), THRESHOLD),
            active="pressed",
        ),
    ),
)

# In the order in which the page, tables, wiring and a board's contract show them.
DEVICES = (MOTOR, LED, ULTRASONIC, VOICE, PIR, FLOOR, INFRARED, SERIAL_LINE, CHASSIS, BUTTON)
