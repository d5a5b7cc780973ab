"""Let the time pass on a simulated chip that its program needs for itself, and count what it allocates. Portable.

The chip's own functions cost what the table says, not what their simulation executes and allocates.
"""

from simulated.costs import COSTS

_MASK = 0x3FFFFFFF
_MISSING = object()


class Meter:
    """Count what the program executes and allocates between two calls of the chip's functions.

    Args:
        chip: a Microcontroller.
        executed: returns the number of instructions executed so far, which wraps at 2^30.
        allocated: returns how many bytes are allocated; None where nobody wants to know.
        flash_is_slow: 1 where the flash needs the longest times of its data sheet, 0 for the typical ones.
    """

    def __init__(self, chip, executed, allocated=None, flash_is_slow=0):
        self.flash_is_slow = flash_is_slow
        self.costs = COSTS[chip.platform]
        self.bytes = 0
        self._chip = chip
        self._executed = executed
        self._allocated = allocated
        self._is_stopped = True
        self._mark = 0
        self._mark_bytes = 0
        self._ns = 0
        self._own = 0
        self._total_ns = 0
        self._calibrate()

    def _calibrate(self):
        """Find how many instructions the simulation of a call adds: those of a call that does nothing."""
        chip, self._chip.meter = self._chip, self
        nothing = timed(chip, _nothing)
        self.start()
        nothing(None)
        before_ns = self._total_ns
        nothing(None)
        nothing(None)
        self._own = (self._total_ns - before_ns) // 2 // self.costs.instruction_ns
        self._is_stopped = True

    def start(self):
        """From now on the program runs."""
        self._is_stopped = False
        if self._allocated:
            self._mark_bytes = self._allocated()
        self._mark = self._executed()

    def stop(self):
        """Let the time pass that the program needed since ``start``; return False where the chip itself calls."""
        if self._is_stopped:
            return False
        count = (self._executed() - self._mark - self._own) & _MASK
        self._is_stopped = True
        if self._allocated:
            self.bytes += self._allocated() - self._mark_bytes
        if count <= _MASK >> 1:
            self._ns += self.scaled(count * self.costs.instruction_ns)
            self._total_ns += count * self.costs.instruction_ns
            self._chip.pass_time(self._ns // 1000)
            self._ns %= 1000
        return True

    def scaled(self, duration):
        """Return the duration of the chip's own work with the frequency that it has now."""
        return duration * (self.costs.hz // 1_000_000) // (self._chip.hz // 1_000_000)


def _nothing(argument):
    pass


def timed(chip, function):
    """Return ``function`` as the program calls it: time passes up to the call, and for the call itself.

    It takes up to three arguments by position: with ``*arguments`` each call would allocate a tuple.
    """

    def call(first=_MISSING, second=_MISSING, third=_MISSING):
        meter = chip.meter
        is_outermost = meter is not None and meter.stop()
        try:
            if is_outermost:
                chip.pass_time(meter.costs.call_us)
            if first is _MISSING:
                return function()
            if second is _MISSING:
                return function(first)
            if third is _MISSING:
                return function(first, second)
            return function(first, second, third)
        finally:
            if is_outermost:
                meter.start()

    return call


def time_methods(chip, owner, *names):
    """Make methods of a class or an object cost time."""
    for name in names:
        setattr(owner, name, timed(chip, getattr(owner, name)))
