"""A microcontroller in virtual time: what MicroPython's modules machine, time, micropython and esp32 offer there.

Time passes where the program sleeps, where a test lets it pass and, with a
meter (timing.py), for each instruction of the program. What is due meanwhile
(bytes, edges, echoes) happens at its own microsecond, with its interrupts. What
the program does to its pins is told to the listeners, each called with
(what, pin, value).
"""

try:
    from micropython import heap_lock, heap_unlock
except ImportError:

    def heap_lock():
        pass

    heap_unlock = heap_lock

from motorcade.words.ticks import TICKS_MASK
from simulated.costs import COSTS, POWER_ON_HZ
from simulated.timing import time_methods, timed


class Microcontroller:
    """The chip itself.

    Args:
        platform: esp32 or rp2.
        ticks_ms: what its clock says at the start; ticks wrap at 2^30.

    Attributes:
        late_us: how long after an edge its interrupt runs, as ESP32s' do; by then the level may be another.
        meter: counts what the program executes; None where that takes no time.
    """

    def __init__(self, platform, ticks_ms=0):
        self.platform = platform
        self.hz = POWER_ON_HZ[platform]
        self.now_us = 0
        self.late_us = 0
        self.meter = None
        # What the clock says in an interrupt handler, where nothing may be allocated; None outside of one.
        self.handled_us = None
        self.levels = {}
        self.duties = {}
        self.listeners = []
        self.interrupts = {}
        self.taken = {}
        # The pins of wires that carry something in both directions.
        self.both_ways = set()
        self._start_us = ticks_ms * 1000
        self._due = []
        # Soft interrupts that wait until the program can be interrupted again; None while it can.
        self._waiting = None
        # Pins whose hard interrupts wait for the end of a change of the flash; None while there is none.
        self._held = None
        self._handling_us = 0

    def ticks_us(self):
        return (self._start_us + self.now_us) & TICKS_MASK

    def ticks_ms(self):
        return (self._start_us + self.now_us) // 1000 & TICKS_MASK

    def at(self, at_us, action, *arguments):
        """Call ``action`` at ``at_us``."""
        # In order, latest first: the next action is then cheap to take, and MicroPython's sort is not stable.
        first, last = 0, len(self._due)
        while first < last:
            middle = (first + last) // 2
            if self._due[middle][0] <= at_us:
                last = middle
            else:
                first = middle + 1
        self._due.insert(first, (at_us, action, arguments))

    def pass_time(self, duration_us):
        """Let ``duration_us`` pass."""
        until_us = self.now_us + duration_us
        while self._due and self._due[-1][0] <= until_us:
            at_us, action, arguments = self._due.pop()
            self.now_us = max(self.now_us, at_us)
            action(*arguments)
            # The program goes on later by the time that handlers took.
            until_us += self._handling_us
            self._handling_us = 0
        self.now_us = max(self.now_us, until_us)

    def block(self, duration_us):
        """Let time pass in which no soft interrupt can run, such as a collection of garbage."""
        self._waiting = []
        self.pass_time(duration_us)
        waiting, self._waiting = self._waiting, None
        self._catch_up(waiting)

    def block_all(self, duration_us):
        """Let time pass in which no interrupt can run: the flash changes, and programs are read from it.

        A pin's edges are one hard interrupt afterwards.
        """
        self._held = []
        self.block(duration_us)
        held, self._held = self._held, None
        self._catch_up(held)

    def _catch_up(self, pins):
        for pin in pins:
            self._call_handler(pin)
        self.pass_time(self._handling_us)
        self._handling_us = 0

    def notify(self, what, pin, value):
        for listener in self.listeners:
            listener(what, pin, value)

    def claim(self, pin, owner):
        """Note the use of a pin. Raises ValueError where it has another use already, an error in the car's code."""
        if self.taken.get(pin, owner) != owner and pin not in self.both_ways:
            raise ValueError(f"GPIO{pin} is {self.taken[pin]} already and shall become {owner}")
        self.taken[pin] = owner

    def drive(self, pin, level):
        if self.levels.get(pin, 0) != level:
            self.levels[pin] = level
            self.notify("level", pin, level)
            self._interrupt(pin, level)

    def set_input(self, pin, level):
        """Change the level of an input, and call its interrupt handler."""
        if self.levels.get(pin, 0) == level:
            return
        self.levels[pin] = level
        self._interrupt(pin, level)

    def _interrupt(self, pin, level):
        """Call a pin's interrupt handler; an output's, too, as a real chip does."""
        handler, trigger, _, is_hard = self.interrupts.get(pin, (None, 0, None, False))
        if handler is None or not trigger & (1 if level else 2):
            return
        late_us = self.late_us
        if self.meter:
            late_us = self.meter.costs.hard_us if is_hard else self.meter.costs.soft_us
        if is_hard and self._held is not None:
            if pin not in self._held:
                self._held.append(pin)
        elif is_hard or self._waiting is None:
            self._later(late_us, pin)
        elif len(self._waiting) < COSTS[self.platform].soft_waiting:
            self._waiting.append(pin)

    def _later(self, late_us, pin):
        if late_us:
            self.at(self.now_us + late_us, self._call_handler, pin)
        else:
            self._call_handler(pin)

    def _call_handler(self, pin):
        """Run an interrupt's handler; a hard one may not allocate memory, as on a real chip."""
        handler, _, number, is_hard = self.interrupts[pin]
        if self.meter:
            self._handling_us += self.meter.costs.hard_us if is_hard else self.meter.costs.soft_us
        self.handled_us = self.ticks_us()
        if is_hard:
            heap_lock()
        try:
            handler(number)
        except MemoryError:
            # It is switched off, so nothing is heard any more.
            del self.interrupts[pin]
        finally:
            if is_hard:
                heap_unlock()
            self.handled_us = None


def machine_of(chip, chips_number=b"\x01\x02\x03\x04"):
    """Return a replacement for the module machine on ``chip``."""

    class Pin:
        IN, OUT, PULL_UP = 0, 1, 2
        IRQ_RISING, IRQ_FALLING = 1, 2

        def __init__(self, number, mode=-1, pull=-1, value=None):
            self.number = number
            if mode == Pin.OUT:
                if chip.platform == "esp32" and number >= 34:
                    raise ValueError("pin can only be input")
                chip.claim(number, "output")
                chip.drive(number, 0 if value is None else value)
            if mode == Pin.IN:
                chip.claim(number, "input")
            if pull == Pin.PULL_UP:
                chip.levels.setdefault(number, 1)

        def init(self, mode):
            chip.taken[self.number] = "output" if mode == Pin.OUT else "input"

        def value(self, level=None):
            if level is None:
                return chip.levels.get(self.number, 0)
            if chip.taken.get(self.number) != "output":
                raise ValueError(f"GPIO{self.number} is no output")
            return chip.drive(self.number, 1 if level else 0)

        def irq(self, handler, trigger, **options):
            if options and (chip.platform == "esp32" or list(options) != ["hard"]):
                raise TypeError("extra keyword arguments given")
            chip.interrupts[self.number] = (handler, trigger, InterruptedPin(chip, self.number), bool(options))

    class PWM:
        def __init__(self, pin, freq, duty_u16):
            if not 10 <= freq <= 40000:
                raise ValueError("freq")
            self._pin = pin.number
            self.duty_u16(duty_u16)

        def duty_u16(self, duty):
            if not 0 <= duty <= 65535:
                raise ValueError("duty")
            if chip.duties.get(self._pin) != duty:
                chip.duties[self._pin] = duty
                chip.notify("duty", self._pin, duty)

    class ADC:
        """An analog input; its pin's level is what it reads."""

        def __init__(self, pin):
            chip.claim(pin.number, "analog input")
            self._number = pin.number

        def read_u16(self):
            return chip.levels.get(self._number, 0)

    class UART:
        def __init__(self, number, baudrate, rxbuf, rx, tx=None):
            self._ring = Ring(rxbuf)
            self._two_bytes_us = 20_000_000 // baudrate
            self._tx = tx and tx.number
            chip.claim(rx.number, f"UART{number}")
            if tx:
                chip.claim(tx.number, f"UART{number}")
            uarts[rx.number] = self
            self.arrive = self._ring.arrive

        def any(self):
            return len(self._ring.bytes)

        def read(self, size=None):
            if size is None:
                # The RP2040's driver reads until the line has been silent for two bytes.
                before = -1
                while chip.platform == "rp2" and before != self._ring.came:
                    before = self._ring.came
                    chip.pass_time(self._two_bytes_us)
                size = len(self._ring.bytes)
            return self._ring.take(size) or None

        def write(self, data):
            chip.notify("bytes", self._tx, data)

    class WDT:
        """The hardware watchdog: it resets the chip where it isn't fed in time. There is one; it can't be deleted."""

        def __init__(self, timeout):
            if chip.platform == "rp2" and timeout > 8388:
                raise ValueError("timeout exceeds 8388")
            machine.watchdog = self
            self._timeout_us = timeout * 1000
            self.feed()
            self._watch()

        def feed(self):
            self._fed_us = chip.now_us

        def _watch(self):
            if machine.watchdog is not self:
                return
            if chip.now_us - self._fed_us >= self._timeout_us:
                raise Reset
            chip.at(self._fed_us + self._timeout_us, self._watch)

    class Memory:
        """The registers: the one that switches an RP2040's watchdog off."""

        def __setitem__(self, address, value):
            if (address, value) != (0x4005B000, 1 << 30) or chip.platform != "rp2":
                raise AssertionError(f"0x{value:X} into register 0x{address:X}")
            machine.watchdog = None

    class Machine:
        def unique_id(self):
            return chips_number

        def freq(self, hz):
            if hz not in (80_000_000, 160_000_000, 240_000_000) or chip.platform != "esp32":
                raise ValueError("frequency")
            chip.hz = hz

        def reset(self):
            raise Reset

        def bitstream(self, pin, encoding, timing, data):
            if chip.platform == "rp2":
                raise AssertionError("no interrupt can run meanwhile")
            chip.notify("pixels", pin.number, data)

    uarts = {}
    for owner, names in ((Pin, ("value",)), (PWM, ("duty_u16",)), (UART, ("any", "read", "write")), (WDT, ("feed",))):
        time_methods(chip, owner, *names)
    machine = Machine()
    machine.Pin, machine.PWM, machine.ADC, machine.UART, machine.WDT = Pin, PWM, ADC, UART, WDT
    machine.uarts = uarts
    machine.mem32 = Memory()
    machine.watchdog = None
    return machine


class InterruptedPin:
    """A pin as its interrupt handler gets it; reading it allocates nothing, also in the simulation."""

    def __init__(self, chip, number):
        self._levels = chip.levels
        self._number = number

    def value(self):
        return self._levels.get(self._number, 0)


class Reset(BaseException):
    """machine.reset() was called, which never returns on a real chip."""


class Ring:
    """The bytes that came and weren't read yet: at most ``size``, any number where that is None."""

    def __init__(self, size):
        self.bytes = b""
        self.came = 0
        self._size = size

    def arrive(self, data):
        self.came += len(data)
        self.bytes += data if self._size is None else data[: self._size - len(self.bytes)]

    def take(self, size):
        data, self.bytes = self.bytes[:size], self.bytes[size:]
        return data


class Clock:
    """A replacement for the module time on ``chip``."""

    def __init__(self, chip):
        self._chip = chip
        time_methods(chip, self, "ticks_ms", "sleep_ms", "sleep_us")
        self._read_us = timed(chip, chip.ticks_us)

    def ticks_ms(self):
        return self._chip.ticks_ms()

    def ticks_us(self):
        if self._chip.handled_us is not None:
            return self._chip.handled_us
        return self._read_us()

    def sleep_ms(self, duration_ms):
        self._chip.pass_time(duration_ms * 1000)

    def sleep_us(self, duration_us):
        self._chip.pass_time(duration_us)


class Usb:
    """The USB line: replaces stdin, stdout, the poll of stdin, and the module micropython."""

    def __init__(self, chip):
        self._chip = chip
        self.ring = Ring(COSTS[chip.platform].stdin_ring_bytes)
        self.interrupt_character = 3
        time_methods(chip, self, "ipoll", "readinto", "write")

    def arrive(self, data):
        self.ring.arrive(data)

    def ipoll(self, timeout_ms):
        return ((self, 1),) if self.ring.bytes else ()

    def readinto(self, buffer):
        buffer[:] = self.read(len(buffer))
        return len(buffer)

    def read(self, size):
        if len(self.ring.bytes) < size:
            raise AssertionError("reading more than is there waits for ever")
        return self.ring.take(size)

    def write(self, data):
        self._chip.notify("bytes", None, bytes(data))

    def kbd_intr(self, character):
        self.interrupt_character = character


class Collector:
    """A replacement for the module gc on ``chip``."""

    def __init__(self, chip):
        self._chip = chip
        self.collections = 0
        time_methods(chip, self, "collect")

    def collect(self):
        self.collections += 1
        if self._chip.meter:
            self._chip.block(self._chip.meter.scaled(self._chip.meter.costs.collect_us))


class Implementation:
    """A replacement for sys.implementation on ``chip``."""

    name = "micropython"

    def __init__(self, chip, version=(1, 27, 0, "")):
        self.version = version
        self._machine = "Raspberry Pi Pico with RP2040" if chip.platform == "rp2" else "Generic ESP32 module with ESP32"
