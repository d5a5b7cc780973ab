"""The serial line: programs come by it."""

from motorcade.devices.declaration import Device, Part, Role

SERIAL_LINE = Device(
    "serial",
    parts=(Part("serial", "GND", (Role("transmit", True, "RX"), Role("receive", False, "TX"))),),
)
