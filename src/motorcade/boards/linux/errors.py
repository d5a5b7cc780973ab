"""What keeps a car's hardware from being used; each says so in a sentence."""


class NoGpioError(Exception):
    """This computer has no pins, or not those."""


class GpioForbiddenError(Exception):
    """This user may not use the pins."""


class InfraredError(Exception):
    """There is no infrared sender, this user may not use it, or it fails."""


class WatchdogError(Exception):
    """There is no watchdog, another program has it, or this user may not use it."""
