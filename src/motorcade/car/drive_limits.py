"""Limit what a driver's command does to the wheels: acceleration, an obstacle ahead and a low battery.

Portable and pure: duties are integers, below 0 for backward; times are arguments in milliseconds that wrap
(`motorcade.words.ticks`). A limit only ever takes speed away. A command to stop, or to drive slower or the other way,
is never delayed.
"""

from motorcade.words.ticks import elapsed_ms

# A motor's load lowers the voltage for a moment, so the battery is low or charged only after so many readings.
READINGS = 3
# The limit is the same for longer pauses between two calls, so that products stay below 2^30.
_LONGEST_PAUSE_MS = 1000
_FASTEST_PER_S = 1 << 18


def duty_per_s(mm_per_s2: int, top_speed_mm_s: int, most_duty: int) -> int:
    """An acceleration as duty a second, at least 1, where ``most_duty`` drives at ``top_speed_mm_s``; 0 stays 0."""
    if mm_per_s2 == 0:
        return 0
    return min(max(mm_per_s2 * most_duty // top_speed_mm_s, 1), _FASTEST_PER_S)


def released_mm(obstacle_stop_mm: int) -> int:
    """From which distance on an obstacle no longer stops a car; farther than it did, so that the car doesn't jerk."""
    return obstacle_stop_mm + obstacle_stop_mm // 4


class DutyLimiter:
    """Say which duty the wheels get.

    Args:
        gain_per_s: how much duty the wheels gain in a second at most; 0 for no limit.
        loss_per_s: how much duty they lose in a second while the battery is low, at least 1.
        most_duty: the duty at which they are fastest.
        obstacle_stop_mm: a nearer obstacle stops a car that drives forward; 0 for never.
        battery_low_mv: a battery below this voltage is low; 0 for never.
        battery_charged_mv: a low battery at this voltage or above is charged again.

    Attributes:
        duty: what the wheels have now.
        obstacle_mm: the distance of the obstacle that lets no forward command pass, or None.
        is_low: whether the battery is low: the wheels then slow down, and gain no speed.
        is_changing: whether the duty changes though the command stays the same, so that `next_duty` is due soon.
    """

    def __init__(
        self,
        gain_per_s: int = 0,
        loss_per_s: int = 1,
        most_duty: int = 255,
        obstacle_stop_mm: int = 0,
        battery_low_mv: int = 0,
        battery_charged_mv: int = 0,
    ) -> None:
        self.duty = 0
        self.obstacle_mm: int | None = None
        self.is_low = False
        self.is_changing = False
        self._gain_per_s = gain_per_s
        self._loss_per_s = loss_per_s
        self._most_duty = most_duty
        self._obstacle_stop_mm = obstacle_stop_mm
        self._battery_low_mv = battery_low_mv
        self._battery_charged_mv = battery_charged_mv
        self._readings = 0
        self._at_ms = 0
        # Thousandths of a duty that were too few for a step.
        self._rest = 0

    def stop(self) -> None:
        """Note that the wheels stand still, whatever stopped them."""
        self.duty = 0
        self.obstacle_mm = None
        self.is_changing = False

    def see_obstacle(self, distance_mm: int | None) -> None:
        """Take the distance of the nearest obstacle ahead; None where no sensor is."""
        limit_mm = self._obstacle_stop_mm
        if self.obstacle_mm is not None:
            limit_mm = released_mm(limit_mm)
        self.obstacle_mm = distance_mm if distance_mm is not None and distance_mm < limit_mm else None

    def see_battery(self, voltage_mv: int) -> None:
        """Take a reading of the battery's voltage."""
        differs = voltage_mv >= self._battery_charged_mv if self.is_low else voltage_mv < self._battery_low_mv
        self._readings = self._readings + 1 if differs else 0
        if self._readings == READINGS:
            self._readings = 0
            self.is_low = not self.is_low

    def next_duty(self, wanted: int, now: int) -> int:
        """The duty at ``now`` of wheels that a command wants to have ``wanted``, -255 to 255."""
        if wanted > 0 and self.obstacle_mm is not None:
            wanted = 0
        pause_ms = min(elapsed_ms(now, self._at_ms), _LONGEST_PAUSE_MS) if self.is_changing else 0
        self._at_ms = now
        if not self.is_changing:
            self._rest = 0
        # Wheels that turn the other way stand still first.
        have = 0 if self.duty * wanted < 0 else abs(self.duty)
        most = abs(wanted)
        if self.is_low:
            most = min(most, max(min(have, self._most_duty) - self._steps(self._loss_per_s, pause_ms), 0))
        elif self._gain_per_s and most > have:
            most = min(most, have + self._steps(self._gain_per_s, pause_ms))
        self.is_changing = most > 0 if self.is_low else most != abs(wanted)
        self.duty = most if wanted > 0 else -most
        return self.duty

    def _steps(self, per_s: int, pause_ms: int) -> int:
        """The whole duties that a rate makes of a pause; the rest counts the next time."""
        thousandths = per_s * pause_ms + self._rest
        self._rest = thousandths % 1000
        return thousandths // 1000
