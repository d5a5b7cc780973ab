"""A stick's two axes as drive words."""

from motorcade.words.formats import DRIVE

FULL_DUTY = 255
CENTRE_DEG = 90


def stick_word(throttle: float, steering: float) -> int:
    """The DRIVE word of a stick.

    Args:
        throttle: -1 full speed back, 0 standing still, 1 full speed ahead.
        steering: -1 full left, 0 straight on, 1 full right, as a stick's horizontal axis.

    Raises:
        ValueError: one of them is out of range or no number.
    """
    for name, value in (("throttle", throttle), ("steering", steering)):
        # Written so that what compares with nothing, nan, is refused too.
        if not -1 <= value <= 1:
            raise ValueError(f"{name} is {value!r}; allowed: -1 to 1")
    return DRIVE.encode(
        code=1,
        angle=CENTRE_DEG - round(steering * CENTRE_DEG),
        direction=int(throttle >= 0),
        speed=round(abs(throttle) * FULL_DUTY),
    )
