"""Random numbers that are the same on CPython and MicroPython. Portable."""


class Random:
    """A 32-bit xorshift generator."""

    def __init__(self, seed):
        self._state = (seed + 1) * 0x9E3779B1 & 0xFFFFFFFF or 1

    def bits(self):
        x = self._state
        x ^= x << 13 & 0xFFFFFFFF
        x ^= x >> 17
        x ^= x << 5 & 0xFFFFFFFF
        self._state = x
        return x

    def below(self, limit):
        return self.bits() % limit

    def between(self, low, high):
        return low + self.below(high - low + 1)

    def one_in(self, times):
        return self.below(times) == 0

    def pick(self, options):
        return options[self.below(len(options))]
