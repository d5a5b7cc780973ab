"""The board of a car on MicroPython: an ESP32 or an RP2040.

Portable. Its parts are in `motorcade.boards.on_chip`; `power_on` there opens it.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable
    from typing import Any

    from motorcade.boards.on_chip.parts import Drivable

from motorcade.boards.on_chip.infrared import InfraredReceiver, PioSender, RmtSender, has_come, open_receiver
from motorcade.boards.on_chip.lines import UploadLine
from motorcade.boards.on_chip.parts import ImageFile, Motor, MotorPair, Ultrasonic
from motorcade.car.board import NOTHING_IN_SIGHT_MM, Board
from motorcade.car.brain import NO_LED, UNIT_US
from motorcade.words.infrared import air_us
from motorcade.words.ticks import TICKS_MASK, elapsed_ms
from motorcade.words.upload import SILENCE_MS

# Longer than a collection of garbage.
_NEEDED_US = 20_000


class MicroPythonBoard(Board):
    """A car's board on a microcontroller.

    Args:
        settings: the contents of car.json (`motorcade.firmware.car_files.settings_of` lists its keys).
        modules: MicroPython's, `motorcade.boards.on_chip.power_on.Modules`.
        line: where uploads come from.
        voice: returns what was heard since the last call, as `SerialVoice.heard_voice` does.
    """

    # No tick may take an RP2040 more than 20 ms. 64 bytes take 6 ms at 115200 baud.
    words_a_tick = 4
    bytes_a_tick = 64
    _sonar: "Callable[..., Ultrasonic]" = Ultrasonic

    def __init__(
        self, settings: "dict[str, Any]", modules: "Any", line: UploadLine, voice: "Callable[[], int]"
    ) -> None:
        machine = modules.machine
        clock = modules.clock
        sender: Any = PioSender
        interrupt = {"hard": True}
        if modules.platform == "esp32":
            # It has no hard interrupts.
            sender = RmtSender
            interrupt = {}
        self.number = settings["number"]
        self.is_leader = settings["is_leader"]
        self.levels = tuple(settings["levels"])
        self._clock = clock
        self._line = line
        self._store, self._names = [
            ImageFile(path, modules.files, modules.open_file) for path in ("car.image", "car.name")
        ]
        self.kind = modules.platform
        self.version = settings.get("version", "")
        self.name = str(self._names.load() or b"", "utf-8")
        self._voice = voice
        pins = settings["pins"]
        self._wheels: MotorPair | None = None
        if "left_motor" in pins and "right_motor" in pins:
            left, right = [self._side(machine, settings, side) for side in ("left", "right")]
            duties = settings["drive_duties"]
            turn_duties = settings["turn_duties"]
            self._wheels = MotorPair(left, right, duties, turn_duties, settings["duty_percents"])
        # LEDs 0 to 3, None for each that isn't there.
        self._leds: list[Any] = []
        for which in range(NO_LED):
            pin = pins.get("leds", {}).get("led_" + str(which))
            led = None
            if pin is not None:
                led = machine.Pin(pin, machine.Pin.OUT, value=0)
            self._leds.append(led)
        self._ultrasonic: Ultrasonic | None = None
        if "ultrasonic" in pins:
            self._ultrasonic = self._sonar(machine, clock, pins["ultrasonic"], settings["range_mm"], interrupt)
        self._inputs = {}
        for part, numbers in settings["inputs"].items():
            self._inputs[part] = [self._input(machine, settings, part, number) for number in numbers]
        infrared = pins.get("infrared", {})
        self._receiver: InfraredReceiver | None = None
        # A leader receives nothing, so it needs no interrupts.
        if "receiver" in infrared and not self.is_leader:
            self._receiver = open_receiver(machine, clock, infrared["receiver"], self.levels[UNIT_US], interrupt)
        self._interrupts_are_hard = bool(interrupt)
        self._sender = None
        if "sender" in infrared:
            self._sender = sender(machine, modules.chip, infrared["sender"], self.levels[UNIT_US])
        self._serial_ms = clock.ticks_ms()
        self._is_sending = False
        self._sent_until_us = 0

    @property
    def sender(self) -> int:  # type: ignore[override]
        """Counts the senders at the line."""
        return self._line.sender

    def now_ms(self) -> int:
        now: int = self._clock.ticks_ms()
        return now & TICKS_MASK

    def load_image(self) -> bytes | None:
        image: bytes | None = self._store.load()
        return image

    def store_image(self, data: bytes) -> None:
        self._store.save(data)

    def read_serial(self) -> bytes:
        data = self._line.read()
        if data:
            self._serial_ms = self._clock.ticks_ms()
        return data

    def write_serial(self, data: bytes) -> None:
        self._line.write(data)

    def answer_requests(self, answer: "Callable[[bytes], bytes]") -> bool:
        return self._line.answer_requests(answer)

    def needs_rest(self) -> bool:
        # Bytes that come by the cable meanwhile would be lost.
        return self._line.needs_rest() and elapsed_ms(self._clock.ticks_ms(), self._serial_ms) >= SILENCE_MS

    def work_at_rest(self) -> None:
        self._line.work_at_rest()

    def store_name(self, name: str) -> None:
        self._names.save(name.encode())
        self.name = name

    def received_frames(self) -> list[int] | tuple[int, ...]:
        return self._receiver.received_frames() if self._receiver else ()

    def has_time(self, may_miss: bool) -> bool:
        """Return whether the loop may do something else for some milliseconds now, without missing a frame or an echo.

        During an upload it may not, since bytes would be lost. Hard interrupts run meanwhile. Where they are soft, no
        frame is missed by a car without a receiver, while the car itself sends, and while a header's long mark begins.
        With ``may_miss`` it is enough that the air is free.
        """
        if elapsed_ms(self._clock.ticks_ms(), self._serial_ms) < SILENCE_MS:
            # An ESP32's line holds 260 bytes, which come in 23 ms.
            return False
        if self._interrupts_are_hard:
            return True
        if self._ultrasonic is not None and self._ultrasonic.is_measuring():
            return False
        if self._receiver is None:
            return True
        needed_until_us = (self._clock.ticks_us() + _NEEDED_US) & TICKS_MASK
        if self._is_sending and not has_come(needed_until_us, self._sent_until_us):
            return True
        return self._receiver.header_begins() or (may_miss and not self.senses_carrier())

    def senses_carrier(self) -> bool:
        return self._receiver is not None and self._receiver.senses_carrier()

    def is_sending(self) -> bool:
        if self._is_sending and has_come(self._clock.ticks_us(), self._sent_until_us):
            self._is_sending = False
        return self._is_sending

    def send_frame(self, frame: int) -> None:
        if self._sender is None:
            return
        self._sender.send(frame)
        self._is_sending = True
        self._sent_until_us = (self._clock.ticks_us() + air_us(frame, self.levels[UNIT_US])) & TICKS_MASK
        if self._receiver is not None:
            self._receiver.ignore_until(self._sent_until_us)

    def obstacle_mm(self) -> int:
        return self._ultrasonic.distance_mm() if self._ultrasonic else NOTHING_IN_SIGHT_MM

    def read_inputs(self, part: str) -> int:
        bits = 0
        place = 0
        for pin in self._inputs.get(part, ()):
            bits = bits | pin.value() << place
            place = place + 1
        return bits

    def heard_voice(self) -> int:
        return self._voice()

    def set_wheels(self, direction: int, speed_level: int) -> None:
        if self._wheels is not None:
            self._wheels.set(direction, speed_level)

    def set_led(self, which: int) -> None:
        for number, led in enumerate(self._leds):
            if led is not None:
                led.value(1 if number == which else 0)

    def _input(self, machine: "Any", settings: "dict[str, Any]", part: str, number: int) -> "Any":
        """Return one of the part's inputs."""
        return machine.Pin(number, machine.Pin.IN)

    def _side(self, machine: "Any", settings: "dict[str, Any]", side: str) -> "Drivable":
        """Return the motor of the left or the right side."""
        return Motor(machine, settings["pins"][side + "_motor"])

    def close(self) -> None:
        """Switch wheels and LEDs off, and close the line."""
        self.set_wheels(0, 0)
        self.set_led(NO_LED)
        self._line.close()
