"""The board of a car whose parts are of other kinds than those of a car that somebody wires: most cars from a shop.

Portable. `power_on` imports it where the pin file asks for one of them.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Mapping, Sequence
    from typing import Any

    from motorcade.boards.on_chip.parts import Drivable

from motorcade.boards.micropython import MicroPythonBoard
from motorcade.boards.on_chip.parts import PWM_HZ, Motor, Ultrasonic
from motorcade.boards.on_chip.pixel_program import STEPS_HZ, assemble_pixels
from motorcade.car.brain import NO_LED

# Green, red and blue of LEDs 0 to 3, yellow, blue, green and pink; and of none.
COLOURS = ((24, 32, 0), (0, 0, 40), (32, 0, 0), (0, 32, 12), (0, 0, 0))
# Of a PWM, and of an analog input.
_FULL = 65535
_DUTY_MAX = 255
# No sensor measures less.
_SHORTEST_ECHO_US = 100
# High and low of a 0 and of a 1, in ns.
_BIT_NS = (400, 850, 800, 450)
# The state machines 0 to 3 share the memory that is full of the infrared sender's program.
_STATE_MACHINE = 4


class PhaseMotor:
    """One motor behind a driver with a pin for the direction and one for the PWM.

    Args:
        machine: MicroPython's module.
        pins: ``direction`` and ``enable``, GPIO numbers.
        forward_is: the level of ``direction`` while the motor turns forward.
    """

    def __init__(self, machine: "Any", pins: "Mapping[str, int]", forward_is: int) -> None:
        self._forward_is = forward_is
        self._direction = machine.Pin(pins["direction"], machine.Pin.OUT, value=0)
        self._pulsed = machine.PWM(machine.Pin(pins["enable"], machine.Pin.OUT, value=0), freq=PWM_HZ, duty_u16=0)

    def drive(self, duty: int) -> None:
        """Turn as Motor.drive does."""
        # No power while the direction changes.
        self._pulsed.duty_u16(0)
        self._direction.value(self._forward_is if duty >= 0 else 1 - self._forward_is)
        self._pulsed.duty_u16(abs(duty) * _FULL // _DUTY_MAX)


class MotorRow:
    """The motors of one side, which turn together."""

    def __init__(self, motors: "Sequence[Drivable]") -> None:
        self._motors = motors

    def drive(self, duty: int) -> None:
        """Turn all motors as Motor.drive does."""
        for motor in self._motors:
            motor.drive(duty)


class AnyUltrasonic(Ultrasonic):
    """An ultrasonic sensor whose trigger and echo may be one wire, ``signal``; the arguments are as Ultrasonic's."""

    def __init__(self, machine: "Any", clock: "Any", pins: "Mapping[str, int]", *others: "Any") -> None:
        self._pin = machine.Pin
        self._has_one_wire = "signal" in pins
        if self._has_one_wire:
            pins = {"trigger": pins["signal"], "echo": pins["signal"]}
        super().__init__(machine, clock, pins, *others)

    def distance_mm(self) -> int:
        if self._width_us < _SHORTEST_ECHO_US:
            # The ping itself came back by its wire.
            self._width_us = 0
        return super().distance_mm()

    def _ping(self, now_ms: int) -> None:
        if self._has_one_wire:
            self._trigger.init(self._pin.OUT)
        super()._ping(now_ms)
        if self._has_one_wire:
            self._trigger.init(self._pin.IN)


class LevelInput:
    """An input that gives 1 at ``active`` (1 high, 0 low), or where its voltage is on that side of a threshold.

    Args:
        machine: MicroPython's module.
        number: of the pin.
        active: the level that counts as 1.
        threshold: in percent of the supply; 0 for a digital input.
        pull: machine.Pin.PULL_UP, or None.
    """

    def __init__(self, machine: "Any", number: int, active: int, threshold: int, pull: "Any" = None) -> None:
        self._active = active
        self._threshold = threshold * _FULL // 100
        if threshold:
            self._pin = machine.ADC(machine.Pin(number))
        else:
            self._pin = machine.Pin(number, machine.Pin.IN, pull)

    def value(self) -> int:
        """Return 1 or 0."""
        if self._threshold:
            level = self._pin.read_u16() > self._threshold
        else:
            level = self._pin.value()
        return 1 if level == self._active else 0


class Pixels:
    """WS2812, all of which show one colour. An RP2040 sends it by a state machine, so that no interrupt waits.

    Args:
        modules: MicroPython's, `motorcade.boards.on_chip.power_on.Modules`.
        number: of the pin.
        count: how many pixels there are.
    """

    def __init__(self, modules: "Any", number: int, count: int) -> None:
        machine = modules.machine
        self._count = count
        self._pin = machine.Pin(number, machine.Pin.OUT, value=0)
        self._state_machine: Any = None
        if modules.platform == "esp32":
            self._send = machine.bitstream
        else:
            rp2 = modules.chip
            program = assemble_pixels(rp2)
            self._state_machine = rp2.StateMachine(
                _STATE_MACHINE, program, freq=STEPS_HZ, set_base=self._pin, out_base=self._pin
            )
            self._state_machine.active(1)
        self.show(NO_LED)

    def show(self, which: int) -> None:
        """Show the colour of LED 0 to 3, or none for 4."""
        colour = COLOURS[which]
        if self._state_machine is None:
            self._send(self._pin, 0, _BIT_NS, bytes(colour) * self._count)
            return
        green, red, blue = colour
        for _ in range(self._count):
            self._state_machine.put(green << 24 | red << 16 | blue << 8)


class AnyBoard(MicroPythonBoard):
    """A car's board, as MicroPythonBoard. ``settings["options"]`` says of parts what their pins do not."""

    _sonar = AnyUltrasonic

    def __init__(self, settings: "dict[str, Any]", modules: "Any", *others: "Any") -> None:
        machine = modules.machine
        pins = settings["pins"]
        options = settings["options"]
        if "button" in pins:
            # Whoever holds it while the power comes on chooses a leader.
            how = options["button"]
            pull = None if how["active"] else machine.Pin.PULL_UP
            button = LevelInput(machine, pins["button"]["signal"], how["active"], how["threshold"], pull)
            settings["is_leader"] = button.value() > 0
        super().__init__(settings, modules, *others)
        self._pixels: Pixels | None = None
        if "pixels" in pins:
            self._pixels = Pixels(modules, pins["pixels"]["signal"], options["pixels"]["count"])
        if self._pixels and "button" in pins:
            # Until its program lights one.
            self._pixels.show(0 if self.is_leader else 1)
        if "horn" in pins:
            machine.Pin(pins["horn"]["signal"], machine.Pin.OUT, value=0)
        if "motor_driver" in pins:
            machine.Pin(pins["motor_driver"]["standby"], machine.Pin.OUT, value=1)

    def set_led(self, which: int) -> None:
        super().set_led(which)
        if self._pixels is not None:
            self._pixels.show(which)

    def _input(self, machine: "Any", settings: "dict[str, Any]", part: str, number: int) -> "LevelInput":
        options = settings["options"].get(part, {})
        return LevelInput(machine, number, options.get("active", 1), options.get("threshold", 0))

    def _side(self, machine: "Any", settings: "dict[str, Any]", side: str) -> "Drivable":
        """Return the motors of the left or the right side."""
        motors: list[Drivable] = []
        for part in (side + "_motor", side + "_rear_motor"):
            wires = settings["pins"].get(part)
            if wires and "direction" in wires:
                motors.append(PhaseMotor(machine, wires, settings["options"][part]["forward_is"]))
            elif wires:
                motors.append(Motor(machine, wires))
        return MotorRow(motors)
