"""The parts at a car's pins: wheels, LEDs, an HC-SR04, and infrared senders and receivers."""


class Observed:
    """Record a car's outputs: wheels, LEDs, infrared frames and answers to uploads.

    ``seen`` has an entry (at_ms, what, value) for each change.
    """

    def __init__(self, chip, pins):
        self.seen = []
        self.carrier_hz = None
        self._chip = chip
        self._pins = pins
        self._shown = {"wheels": (0, 0), "leds": ()}
        chip.listeners.append(self._take)

    def look(self):
        """Record the state of wheels and LEDs where it has changed."""
        self._note("wheels", (self.power("left_motor"), self.power("right_motor")))
        self._note("leds", self.lit_leds())

    def power(self, part):
        """Return a motor's duty, below 0 for backward."""
        levels, motor = self._chip.levels, self._pins[part]
        direction = levels.get(motor["forward"], 0) - levels.get(motor["backward"], 0)
        return direction * self._chip.duties.get(motor["enable"], 0)

    def lit_leds(self):
        leds = self._pins["leds"]
        return tuple([led for led in range(4) if self._chip.levels.get(leds["led_" + str(led)], 0)])

    def _note(self, what, value):
        if self._shown[what] != value:
            self._shown[what] = value
            self.seen.append((self._chip.now_us // 1000, what, value))

    def _take(self, what, pin, value):
        if what == "infrared":
            self.seen.append((self._chip.now_us // 1000, "infrared", tuple(value)))
        if what == "bytes":
            self.seen.append((self._chip.now_us // 1000, "line", value))
        if what == "carrier":
            self.carrier_hz = value


class HcSr04:
    """The ultrasonic sensor: after a pulse of 10 µs or more at TRIG, ECHO is high for the time of flight."""

    PREPARES_US = 460
    NOTHING_US = 38_000

    def __init__(self, chip, pins):
        self.distance_mm = None
        self.pings = 0
        self._chip = chip
        self._pins = pins
        if "signal" in pins:
            # Trigger and echo are one wire.
            self._pins = {"trigger": pins["signal"], "echo": pins["signal"]}
            chip.both_ways.add(pins["signal"])
        self._rose_us = 0
        chip.listeners.append(self._take)

    def _take(self, what, pin, value):
        if what != "level" or pin != self._pins["trigger"]:
            return
        now_us = self._chip.now_us
        if value:
            self._rose_us = now_us
        elif now_us - self._rose_us >= 10:
            self.pings += 1
            nothing = self.distance_mm is None
            width_us = self.NOTHING_US if nothing else self.distance_mm * 2000 // 343
            self._chip.at(now_us + self.PREPARES_US, self._chip.set_input, self._pins["echo"], 1)
            self._chip.at(now_us + self.PREPARES_US + width_us, self._chip.set_input, self._pins["echo"], 0)


class Air:
    """The infrared that reaches the receiver: frames of others, noise, and the echo of the car's own frames."""

    def __init__(self, chip, pins):
        self._chip = chip
        self._pin = pins["receiver"]
        chip.set_input(self._pin, 1)
        chip.listeners.append(self._take)

    def pulses(self, at_us, durations_us):
        """Send marks and spaces to the receiver from ``at_us`` on, beginning with a mark."""
        for place, duration_us in enumerate(durations_us):
            self._chip.at(at_us, self._chip.set_input, self._pin, place & 1)
            at_us += duration_us
        self._chip.at(at_us, self._chip.set_input, self._pin, 1)

    def _take(self, what, pin, value):
        if what == "infrared":
            # The car's own light comes back from near objects a little later.
            self.pulses(self._chip.now_us + 50, value)
