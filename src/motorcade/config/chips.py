"""The computers that a car may have: their pins, and what runs on them. All other modules read this table."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from motorcade.errors import Phrase


class Caution(NamedTuple):
    """What a pin does at power-on, or what is there on the board.

    Attributes:
        reason: the end of a sentence that begins with the pin.
        concerns: which wires it matters for: "all", "read", or those that "act" while no program runs.
    """

    reason: Phrase
    concerns: str = "all"


class Firmware(NamedTuple):
    """MicroPython on a board with a chip, as the board itself calls it.

    Attributes:
        name: the chip's, for users and programs.
        title: the board's name for people.
        platform: sys.platform there.
        machine: what its sys.implementation._machine holds, where others have the same platform.
    """

    name: str
    title: str
    platform: str
    machine: str = ""


class Chip(NamedTuple):
    """A computer that a car may have.

    Attributes:
        name: its name in a pin file.
        title: its name for people.
        header: for each pin that a car may use, its number on the connector, or 0 where boards differ.
        input_only: pins that can be read but not driven.
        taken: pins that the computer needs for itself, each with the reason.
        only: for wires that not every pin can serve, such as ``infrared.sender``, the pins that can.
        cautions: pins that a car may use, but that do something at power-on or carry a load.
        lacks: parts, or wires of parts, that its cars can't have.
        analog: the pins whose voltage it can measure; of them ``analog_only`` can do nothing else.
        names: what is printed at a pin, where that isn't GPIO and its number.
        prefixes: what stands before the number of a pin otherwise; pin files may have the number alone, too.
        has_5_v_pins: whether its pins give and take 5 V; otherwise 3.3 V.
        runs_linux: whether Motorcade itself runs on it.
        micropython: the boards with it, or with a chip that has the same pins, whose MicroPython runs a car.
        has_wifi: whether such a car can join a Wi-Fi network.
        uarts: which of its UARTs a MicroPython car has for a device; empty where the pins decide.
        sends_at: the pins that such a UART sends on even if it is set up only to receive, by the device.
        arduino: what Arduino's compilers define for it, one of them for each of its boards; empty where the Arduino
            library isn't for it. All chips of the ESP32's family are ARDUINO_ARCH_ESP32, with other pins.
        is_whole_arduino: whether that library has everything for it: it sends infrared and hears a voice module.
        fastest_voice_baud: what an interrupt for each edge can follow there; 0 for any.
    """

    name: str
    title: str
    header: dict[int, int]
    input_only: frozenset[int] = frozenset()
    taken: Mapping[int, Phrase] = MappingProxyType({})
    only: Mapping[str, tuple[int, ...]] = MappingProxyType({})
    cautions: Mapping[int, tuple[Caution, ...]] = MappingProxyType({})
    lacks: frozenset[str] = frozenset()
    analog: tuple[int, ...] = ()
    analog_only: frozenset[int] = frozenset()
    names: Mapping[int, str] = MappingProxyType({})
    prefixes: tuple[str, ...] = ("GPIO",)
    has_5_v_pins: bool = False
    runs_linux: bool = False
    micropython: tuple[Firmware, ...] = ()
    has_wifi: bool = False
    uarts: Mapping[str, int] = MappingProxyType({})
    sends_at: Mapping[str, int] = MappingProxyType({})
    arduino: tuple[str, ...] = ()
    is_whole_arduino: bool = False
    fastest_voice_baud: int = 0

    def label(self, pin: int) -> str:
        """Return what to look for on the board: ``GPIO17 (11)`` is GPIO 17, the connector's pin 11."""
        if pin in self.names:
            return self.names[pin]
        place = self.header[pin]
        return f"GPIO{pin} ({place})" if place else f"GPIO{pin}"

    def pin_named(self, name: str) -> int | None:
        """Return the pin where ``name`` is printed on the board, such as ``A0`` or ``GP5``; None where none is."""
        for pin in (*self.header, *self.taken):
            printed = [f"{prefix}{pin}" for prefix in self.prefixes]
            if pin in self.names:
                printed = [self.names[pin]]
            if name.upper() in printed:
                return pin
        return None


_RASPBERRY_PI_ORDER = (
    *((2, 3), (3, 5), (4, 7), (14, 8), (15, 10), (17, 11), (18, 12), (27, 13), (22, 15), (23, 16), (24, 18), (10, 19)),
    *((9, 21), (25, 22), (11, 23), (8, 24), (7, 26), (5, 29), (6, 31), (12, 32), (13, 33), (19, 35), (16, 36)),
    *((26, 37), (20, 38), (21, 40)),
)
_PICO_ORDER = (
    *((0, 1), (1, 2), (2, 4), (3, 5), (4, 6), (5, 7), (6, 9), (7, 10), (8, 11), (9, 12), (10, 14), (11, 15), (12, 16)),
    *((13, 17), (14, 19), (15, 20), (16, 21), (17, 22), (18, 24), (19, 25), (20, 26), (21, 27), (22, 29), (26, 31)),
    *((27, 32), (28, 34)),
)
# The most lines that one gpiochip of a small computer has.
_MAX_LINES = 512
_ESP32_USABLE = (0, 2, 4, 5, *range(12, 20), *range(21, 24), *range(25, 28), *range(32, 40))

# An Arduino's analog pins follow its digital ones; pins 0 and 1 are the USB port's serial line.
_UNO_PINS = range(2, 22)
_MEGA_PINS = range(2, 70)
_MEGA_PWM = (*range(2, 9), 13, 44, 45, 46)
_MEGA_INTERRUPTS = (2, 3, *range(18, 22))
_UNO_NAMES = {pin: f"D{pin}" if pin < 14 else f"A{pin - 14}" for pin in _UNO_PINS}
_MEGA_NAMES = {pin: f"D{pin}" if pin < 54 else f"A{pin - 54}" for pin in _MEGA_PINS}

_MEMORY = Phrase("pin-of-memory")
_FLASH = Phrase("pin-of-flash")
_USB = Phrase("pin-of-usb")
# Sources: data sheets of ESP32 (strapping pins), BCM2835 (pulls at reset) and Raspberry Pi (pull-ups of its I2C bus),
# the schematics of Arduino boards.
_ESP32_CAUTIONS = {
    0: (Caution(Phrase("pin-boots-low")),),
    2: (Caution(Phrase("pin-boots-high")),),
    5: (Caution(Phrase("pin-pulses")),),
    12: (Caution(Phrase("pin-sets-flash-voltage")),),
    14: (Caution(Phrase("pin-pulses"), "act"),),
    15: (Caution(Phrase("pin-pulses")),),
}
_PULLED_UP = Caution(Phrase("pin-pulled-up"), "act")
_PI_CAUTIONS = {
    **dict.fromkeys(range(4, 9), (_PULLED_UP,)),
    **dict.fromkeys((2, 3), (Caution(Phrase("pin-held-up")),)),
}
_ARDUINO_CAUTIONS = {13: (Caution(Phrase("pin-with-led"), "read"), Caution(Phrase("pin-blinks"), "act"))}


# Those of a car with two or four wheels.
MOTORS = ("left_motor", "right_motor", "left_rear_motor", "right_rear_motor")
# What only boards without an operating system drive.
_OF_CHIPS = frozenset(
    {"pixels", "button", "motor_driver", *MOTORS[2:], "ultrasonic.signal"}
    | {f"{motor}.direction" for motor in (*MOTORS[:2], "drive_motor")}
)
# What only cars that somebody drives over a network have.
_OF_DRIVERS = frozenset({"servo", "drive_motor", "head_light"})


def _only(pwm: tuple[int, ...], sender: tuple[int, ...], **more: tuple[int, ...]) -> dict[str, tuple[int, ...]]:
    """The wires of an Arduino that not every pin can serve."""
    return {f"{motor}.enable": pwm for motor in MOTORS} | {"infrared.sender": sender} | more


CHIPS = (
    Chip(
        "raspberry-pi",
        "Raspberry Pi",
        dict(_RASPBERRY_PI_ORDER),
        taken={0: _MEMORY, 1: _MEMORY},
        cautions=_PI_CAUTIONS,
        lacks=_OF_CHIPS,
        runs_linux=True,
    ),
    Chip(
        "rp2040",
        "Raspberry Pi Pico (RP2040)",
        dict(_PICO_ORDER),
        taken={
            23: Phrase("pin-of-supply-switch"),
            24: Phrase("pin-of-usb-sensing"),
            25: Phrase("pin-of-board-led"),
            29: Phrase("pin-of-supply-measure"),
        },
        lacks=_OF_DRIVERS,
        analog=(26, 27, 28),
        prefixes=("GPIO", "GP"),
        micropython=(
            Firmware("rp2350", "Raspberry Pi Pico 2", "rp2", "RP2350"),
            Firmware("rp2040", "Raspberry Pi Pico", "rp2"),
        ),
        arduino=("ARDUINO_ARCH_RP2040",),
    ),
    Chip(
        "esp32",
        "ESP32",
        dict.fromkeys(_ESP32_USABLE, 0),
        frozenset(range(34, 40)),
        {**dict.fromkeys(range(6, 12), _FLASH), 1: _USB, 3: _USB},
        cautions=_ESP32_CAUTIONS,
        lacks=_OF_DRIVERS,
        # Its other converter belongs to the Wi-Fi.
        analog=tuple(range(32, 40)),
        prefixes=("GPIO", "IO"),
        micropython=(Firmware("esp32", "ESP32", "esp32"),),
        has_wifi=True,
        uarts={"serial": 1, "voice": 2},
        sends_at={"voice": 17},
        arduino=("CONFIG_IDF_TARGET_ESP32",),
    ),
    # Infrared leaves at an output of timer 2, and timers 1 and 2 drive no motors then. On a Mega receivers need an
    # interrupt each, and the voice module a UART.
    Chip(
        "arduino-uno",
        "Arduino Uno or Nano",
        dict.fromkeys(_UNO_PINS, 0),
        taken={0: _USB, 1: _USB},
        only=_only(pwm=(5, 6), sender=(11, 3)),
        lacks=_OF_DRIVERS,
        analog=tuple(range(14, 22)),
        # A Nano has them, and other boards with this chip.
        analog_only=frozenset((20, 21)),
        cautions=_ARDUINO_CAUTIONS,
        names=_UNO_NAMES,
        has_5_v_pins=True,
        arduino=("__AVR_ATmega328P__", "__AVR_ATmega328__"),
        is_whole_arduino=True,
        fastest_voice_baud=19200,
    ),
    Chip(
        "arduino-mega",
        "Arduino Mega 2560",
        dict.fromkeys(_MEGA_PINS, 0),
        taken={0: _USB, 1: _USB},
        only=_only(
            pwm=_MEGA_PWM,
            sender=(10,),
            **dict.fromkeys(("ultrasonic.echo", "ultrasonic.signal", "infrared.receiver"), _MEGA_INTERRUPTS),
            **{"voice.receive": (19,)},
        ),
        lacks=_OF_DRIVERS,
        analog=tuple(range(54, 70)),
        cautions=_ARDUINO_CAUTIONS,
        names=_MEGA_NAMES,
        has_5_v_pins=True,
        arduino=("__AVR_ATmega2560__", "__AVR_ATmega1280__"),
        is_whole_arduino=True,
    ),
    Chip(
        "linux",
        "another computer with Linux",
        dict.fromkeys(range(_MAX_LINES), 0),
        lacks=_OF_CHIPS,
        runs_linux=True,
    ),
)

# Each board whose MicroPython runs a car, and its chip in pin files.
MICROPYTHON = {firmware.name: (firmware, chip) for chip in CHIPS for firmware in chip.micropython}


def chip_named(name: str) -> Chip:
    """Return the chip that pin files call ``name``. Raises KeyError."""
    return {chip.name: chip for chip in CHIPS}[name]
