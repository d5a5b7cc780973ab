"""A microcontroller in virtual time: what MicroPython's modules machine, time, micropython and esp32 offer there.

Time passes only where the program sleeps, or where a test lets it pass. What
is due meanwhile (bytes, edges, echoes) happens at its own microsecond, with its
interrupts. What the program does to its pins is told to the listeners, each
called with (what, pin, value).
"""

from motorcade.words.ticks import TICKS_MASK


class Microcontroller:
    """The chip itself.

    Args:
        platform: esp32 or rp2.
        ticks_ms: what its clock says at the start; ticks wrap at 2^30.

    Attributes:
        late_us: how long after an edge its interrupt runs, as ESP32s' do; by then the level may be another.
    """

    def __init__(self, platform, ticks_ms=0):
        self.platform = platform
        self.now_us = 0
        self.late_us = 0
        self.levels = {}
        self.duties = {}
        self.listeners = []
        self.interrupts = {}
        self.taken = {}
        self._start_us = ticks_ms * 1000
        self._due = []
        self._order = 0

    def ticks_us(self):
        return (self._start_us + self.now_us) & TICKS_MASK

    def ticks_ms(self):
        return (self._start_us + self.now_us) // 1000 & TICKS_MASK

    def at(self, at_us, action, *arguments):
        """Call ``action`` at ``at_us``."""
        self._order += 1
        self._due.append((at_us, self._order, action, arguments))
        # Insert in order, latest first: the next action is then cheap to take, and MicroPython's sort is not stable.
        place = len(self._due) - 1
        while place and self._due[place - 1][:2] < self._due[place][:2]:
            self._due[place - 1], self._due[place] = self._due[place], self._due[place - 1]
            place -= 1

    def pass_time(self, duration_us):
        """Let ``duration_us`` pass."""
        until_us = self.now_us + duration_us
        while self._due and self._due[-1][0] <= until_us:
            at_us, _, action, arguments = self._due.pop()
            self.now_us = max(self.now_us, at_us)
            action(*arguments)
        self.now_us = max(self.now_us, until_us)

    def notify(self, what, pin, value):
        for listener in self.listeners:
            listener(what, pin, value)

    def claim(self, pin, owner):
        """Note the use of a pin. Raises ValueError where it has another use already, an error in the car's code."""
        if self.taken.get(pin, owner) != owner:
            raise ValueError(f"GPIO{pin} is {self.taken[pin]} already and shall become {owner}")
        self.taken[pin] = owner

    def drive(self, pin, level):
        if self.levels.get(pin, 0) != level:
            self.levels[pin] = level
            self.notify("level", pin, level)

    def set_input(self, pin, level):
        """Change the level of an input, and call its interrupt handler."""
        if self.levels.get(pin, 0) == level:
            return
        self.levels[pin] = level
        handler, trigger, number = self.interrupts.get(pin, (None, 0, None))
        if handler is None or not trigger & (1 if level else 2):
            return
        if self.late_us:
            self.at(self.now_us + self.late_us, handler, number)
        else:
            handler(number)


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

        def value(self, level=None):
            if level is None:
                return chip.levels.get(self.number, 0)
            if chip.taken.get(self.number) != "output":
                raise ValueError(f"GPIO{self.number} is no output")
            return chip.drive(self.number, 1 if level else 0)

        def irq(self, handler, trigger, **options):
            if options and (chip.platform == "esp32" or list(options) != ["hard"]):
                raise TypeError("extra keyword arguments given")
            chip.interrupts[self.number] = (handler, trigger, self)

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

    class UART:
        def __init__(self, number, baudrate, rxbuf, rx, tx=None):
            self._size = rxbuf
            self._received = b""
            self._tx = tx and tx.number
            chip.claim(rx.number, f"UART{number}")
            if tx:
                chip.claim(tx.number, f"UART{number}")
            uarts[rx.number] = self

        def arrive(self, data):
            self._received = (self._received + data)[: self._size]

        def read(self):
            data, self._received = self._received, b""
            return data or None

        def write(self, data):
            chip.notify("bytes", self._tx, data)

    class Machine:
        def unique_id(self):
            return chips_number

        def reset(self):
            raise Reset

    uarts = {}
    machine = Machine()
    machine.Pin, machine.PWM, machine.UART = Pin, PWM, UART
    machine.uarts = uarts
    return machine


class Reset(BaseException):
    """machine.reset() was called, which never returns on a real chip."""


class Clock:
    """A replacement for the module time on ``chip``."""

    def __init__(self, chip):
        self._chip = chip

    def ticks_ms(self):
        return self._chip.ticks_ms()

    def ticks_us(self):
        return self._chip.ticks_us()

    def sleep_ms(self, duration_ms):
        self._chip.pass_time(duration_ms * 1000)

    def sleep_us(self, duration_us):
        self._chip.pass_time(duration_us)


class Usb:
    """The USB line: replaces stdin, stdout, the poll of stdin, and the module micropython."""

    def __init__(self, chip):
        self._chip = chip
        self._received = b""
        self.interrupt_character = 3

    def arrive(self, data):
        self._received += data

    def poll(self, timeout_ms):
        return [(self, 1)] if self._received else []

    def read(self, size):
        if len(self._received) < size:
            raise AssertionError("reading more than is there waits for ever")
        data, self._received = self._received[:size], self._received[size:]
        return data

    def write(self, data):
        self._chip.notify("bytes", None, data)

    def kbd_intr(self, character):
        self.interrupt_character = character


class Esp32:
    """A replacement for the module esp32 on ``chip``: the transmitter of remote control signals (RMT)."""

    def __init__(self, chip):
        class RMT:
            def __init__(self, channel, pin, clock_div, tx_carrier):
                if 80_000_000 % clock_div:
                    raise ValueError("this simulation takes whole frequencies")
                self._nominal_us = clock_div / 80
                self._pin = pin.number
                self._free_us = 0
                chip.notify("carrier", self._pin, tx_carrier[0])

            def write_pulses(self, durations, data=True):
                if not data or not all(1 <= duration <= 32767 for duration in durations):
                    raise ValueError("durations must be 1 to 32767, and this simulation begins with a mark")
                if chip.now_us < self._free_us:
                    raise AssertionError("write_pulses waits for the end of the pulses before")
                durations_us = [round(duration * self._nominal_us) for duration in durations]
                self._free_us = chip.now_us + sum(durations_us)
                chip.notify("infrared", self._pin, durations_us)

        self.RMT = RMT
