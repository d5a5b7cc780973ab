"""How each kind of wheels does what is meant for the other: plain functions of integers.

A DRIVE word has a servo's angle and one motor's duty; a control word turns on the spot, which takes two motors.
"""

from motorcade.car.brain import LEFT, RIGHT

FULL_LEFT_DEG = 180
CENTRE_DEG = 90
FULL_RIGHT_DEG = 0


def motor_duties(angle_deg: int, direction: int, speed: int) -> tuple[int, int]:
    """The duties of a left and a right motor for a DRIVE word; negative ones turn backward.

    The outer wheel has the word's duty, the inner one the less of it the further the servo would turn:
    all of it at 90 degrees, half at 45 and 135, none at 0 and 180, where the car turns about its inner wheel.

    Args:
        angle_deg: 0 to 180; below 90 is right.
        direction: 1 forward, 0 backward.
        speed: duty, 0 to 255.
    """
    off_deg = abs(angle_deg - CENTRE_DEG)
    inner = (speed * (CENTRE_DEG - off_deg) + CENTRE_DEG // 2) // CENTRE_DEG
    left, right = (speed, inner) if angle_deg < CENTRE_DEG else (inner, speed)
    return (left, right) if direction else (-left, -right)


def servo_angle_deg(direction: int) -> int:
    """The servo's angle for a control word's direction; a turn on the spot becomes full lock to that side."""
    return {LEFT: FULL_LEFT_DEG, RIGHT: FULL_RIGHT_DEG}.get(direction, CENTRE_DEG)
