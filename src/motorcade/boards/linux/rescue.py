"""What stops the wheels of a process that died. Its guard imports this while all is well: later there is no time."""

from contextlib import suppress

from motorcade.boards.linux.chips import CHIPS
from motorcade.boards.linux.gpio_chip import open_gpio, prepare

# Why there are no pins is said by who tries to use them.
with suppress(ImportError, OSError):
    prepare()


def pull_low(chip: str, number: str, *pins: str) -> None:
    """Make ``pins`` drive low, as the kernel keeps a pin as it was.

    Args:
        chip: the name of one of CHIPS.
        number: as in `motorcade.boards.linux.gpio_chip.open_gpio`; ``""`` for none.
    """
    factory = open_gpio(next(each for each in CHIPS if each.name == chip), int(number) if number else None)
    for pin in pins:
        factory.pin(int(pin)).output_with_state(False)
