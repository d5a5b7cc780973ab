"""Measure a car: what its profile says of its wheels, fitted to what a ruler shows after six moves.

**The model.** The car drives at once as fast as its speed level says, on a circle with the curvature k: after T seconds
at the speed v it has come v T along the circle, and has turned by k v T. Then it rolls on, straight ahead, as far as it
drives in its stopping time. On the spot it turns for T at its turn rate. The turn rates of the lower levels are to the
highest as the speeds are, because the same duties make both.

**The fit** is one of least squares, by Gauss and Newton, with differences for derivatives. A way counts by
the error with which a ruler shows it, an angle by that of a protractor. An uncertainty is one standard deviation; it
grows where the readings differ from the model by more than those errors.

None of it needs NumPy, which a page's worker doesn't have.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

from motorcade.config.profile import Profile, profile_from_dict
from motorcade.errors import InputError, Phrase

# How well a pupil reads a ruler and a protractor, and how equally a car repeats a move.
RULER_MM = 5.0
PROTRACTOR_DEG = 3.0
LEAST_CM = 2
MOST_CM = 1000
LEAST_DEG = 10
MOST_DEG = 3600
_MM_PER_CM = 10
# A car that bends more drives in a circle, and a ruler shows its way no longer.
_MOST_BEARING_DEG = 60
# In one second a car that rolls on, or starts late, comes this share of its way of three seconds.
_SHORT_SHARES = (0.2, 0.6)
_MOST_TURNS_RATIO = 1.5
# By how many times their errors readings may differ from the model.
_MOST_MISFIT = 8.0
_STEPS = 6
# Places of the figures, besides the speeds of levels 1 to 3: deg/s, mrad/m and ms.
_FASTEST = 2
_TURN = 3
_DRIFT = 4
_STOPPING = 5
# The step of a derivative, in the units of each figure.
_STEP = 1e-3

# What a ruler shows in mm, ahead and to the left; or by how many degrees the car has turned.
Reading = tuple[float, ...]
Readings = Mapping[str, Sequence[Reading]]


class CalibrationMove(NamedTuple):
    """One move of a car: a direction of `drive`, a speed level and a time."""

    key: str
    direction: str
    level: int
    seconds: int

    @property
    def turns(self) -> bool:
        """Whether the car turns on the spot, so that an angle is read."""
        return self.direction != "forward"

    @property
    def title(self) -> Phrase:
        """What sentences call the move."""
        return Phrase(f"move-{self.key}", seconds=self.seconds)


MOVES = (
    CalibrationMove("slow", "forward", 1, 3),
    CalibrationMove("medium", "forward", 2, 3),
    CalibrationMove("fast", "forward", 3, 3),
    CalibrationMove("short", "forward", 3, 1),
    CalibrationMove("left", "left", 3, 3),
    CalibrationMove("right", "right", 3, 3),
)
_MOVES = {move.key: move for move in MOVES}


# Each reading with its move.
Rows = Sequence[tuple[CalibrationMove, Reading]]


class Figure(NamedTuple):
    """A measured value, and its uncertainty: one standard deviation."""

    value: float
    uncertainty: float

    def __str__(self) -> str:
        return f"{self.value:.1f} ± {self.uncertainty:.1f}"


@dataclass(frozen=True, slots=True)
class Calibration:
    """What was measured of a car.

    Attributes:
        speeds_mm_s: of speed levels 1 to 3.
        turn_rates_deg_s: the same for turns on the spot.
        drift_mrad_per_m, stopping_ms: as `motorcade.config.profile.MeasuredWheels` has them.
        left_percent, right_percent: the share of its duty that each motor needs so that both wheels are equal.
    """

    speeds_mm_s: tuple[Figure, ...]
    turn_rates_deg_s: tuple[Figure, ...]
    drift_mrad_per_m: Figure
    stopping_ms: Figure
    left_percent: float
    right_percent: float


def readings_of(move: CalibrationMove, text: str) -> list[Reading]:
    """Return what a person wrote of a move: ``88.5 3`` for cm ahead and to the left, or degrees.

    Without a second number the car went straight; to the right it is negative. A semicolon separates two drives.
    Raises MotorcadeError.
    """
    return [_reading_of(move, part) for part in text.replace("；", ";").split(";")]


def _reading_of(move: CalibrationMove, text: str) -> Reading:
    try:
        numbers = [float(part) for part in text.replace(",", ".").split()]
    except ValueError:
        numbers = []
    if move.turns and len(numbers) == 1:
        return (numbers[0],)
    if not move.turns and len(numbers) in (1, 2):
        ahead, left = (*numbers, 0.0)[:2]
        return ahead * _MM_PER_CM, left * _MM_PER_CM
    raise InputError("no-angle" if move.turns else "no-way", text=text[:40])


def check_readings(readings: Readings) -> None:
    """Refuse what no car can have done, as soon as it is known. Raises MotorcadeError, which says what to measure."""
    for key, found in readings.items():
        for reading in found:
            _check_reading(_MOVES[key], reading)
    ways = {key: _mean(math.hypot(*reading) for reading in found) for key, found in readings.items() if found}
    for slower, faster in (("slow", "medium"), ("medium", "fast")):
        if slower in ways and faster in ways and ways[slower] >= ways[faster]:
            raise InputError("slower-went-farther", slower=_MOVES[slower].title, faster=_MOVES[faster].title)
    if "fast" in ways and "short" in ways:
        least, most = _SHORT_SHARES
        if not least <= ways["short"] / ways["fast"] <= most:
            cm = {key: round(ways[key] / _MM_PER_CM) for key in ("short", "fast")}
            raise InputError("short-way-unlikely", **cm)
    if "left" in ways and "right" in ways:
        angles = sorted((ways["left"], ways["right"]))
        if angles[1] > _MOST_TURNS_RATIO * angles[0]:
            raise InputError("turns-differ", left=round(ways["left"]), right=round(ways["right"]))


def _check_reading(move: CalibrationMove, reading: Reading) -> None:
    if move.turns:
        if not LEAST_DEG <= reading[0] <= MOST_DEG:
            raise InputError("angle-unlikely", move=move.title, value=reading[0], least=LEAST_DEG, most=MOST_DEG)
        return
    ahead, left = reading
    way_cm = math.hypot(ahead, left) / _MM_PER_CM
    if not LEAST_CM <= way_cm <= MOST_CM:
        raise InputError("way-unlikely", move=move.title, value=round(way_cm, 1), least=LEAST_CM, most=MOST_CM)
    if abs(math.degrees(math.atan2(left, ahead))) > _MOST_BEARING_DEG:
        raise InputError("car-circles", move=move.title)


def fit(readings: Readings) -> Calibration:
    """Return what the readings of all MOVES, one or more of each, say of the car. Raises MotorcadeError."""
    for move in MOVES:
        if not readings.get(move.key):
            raise InputError("reading-missing", move=move.title)
    check_readings(readings)
    rows = [(move, reading) for move in MOVES for reading in readings[move.key]]
    ways = {key: _mean(math.hypot(*reading) for reading in found) for key, found in readings.items()}
    figures = [ways[move.key] / move.seconds for move in MOVES[:3]]
    figures += [_mean((ways["left"], ways["right"])) / 3, 0.0, 0.0]
    places = range(len(figures))
    covariance = _fitted(figures, places, rows)
    scale = max(1.0, _misfit(figures, rows))
    errors = [scale * math.sqrt(covariance[place][place]) for place in places]
    if figures[_STOPPING] < 0:
        # No car stops before it is told to: within the errors it stops at once.
        figures[_STOPPING] = 0.0
        _fitted(figures, places[:_STOPPING], rows)
    return _calibration(figures, errors)


def told(found: Calibration) -> list[Phrase]:
    """Return a sentence for each thing that was measured, with its uncertainty."""
    # A car that turns by k on a metre comes k / 2 of a metre to the side.
    drift = found.drift_mrad_per_m
    side = "left" if drift.value >= 0 else "right"
    fastest_cm_ms = found.speeds_mm_s[_FASTEST].value / 1e4
    rolled = Figure(*(fastest_cm_ms * value for value in found.stopping_ms))
    return [
        Phrase("measured-speeds", values=", ".join(map(str, found.speeds_mm_s))),
        Phrase("measured-turns", values=", ".join(map(str, found.turn_rates_deg_s))),
        Phrase(f"measured-drift-{side}", value=Figure(abs(drift.value) / 20, drift.uncertainty / 20)),
        Phrase("measured-stopping", value=rolled),
        Phrase("measured-duties", left=f"{found.left_percent:.0f}", right=f"{found.right_percent:.0f}"),
    ]


def _calibration(figures: list[float], errors: list[float]) -> Calibration:
    found = [Figure(value, error) for value, error in zip(figures, errors, strict=True)]
    speeds = tuple(found[: _FASTEST + 1])
    turn = found[_TURN]
    rates = []
    for speed in speeds[:-1]:
        value = turn.value * speed.value / speeds[-1].value
        rates.append(Figure(value, value * math.hypot(turn.uncertainty / turn.value, speed.uncertainty / speed.value)))
    # Wheels that differ by d of their mean turn the car by d / wheel base; on the spot, both turn it by 2 / wheel base.
    base_m = 2 * speeds[-1].value / 1000 / math.radians(turn.value)
    half = figures[_DRIFT] / 1000 * base_m / 2
    slower = 1 - abs(half)
    left, right = (100 * slower / (1 + side * half) for side in (-1, 1))
    return Calibration(speeds, (*rates, turn), found[_DRIFT], found[_STOPPING], left, right)


def _shown(move: CalibrationMove, figures: Sequence[float]) -> Reading:
    """What is read after a move of a car with these figures."""
    if move.turns:
        return (figures[_TURN] * move.seconds,)
    speed = figures[move.level - 1]
    way = speed * move.seconds
    turned = figures[_DRIFT] * way / 1e6
    # The chord of an arc lies half-way between the headings at its ends.
    half = turned / 2
    chord = way
    if half:
        chord = way * math.sin(half) / half
    rolled = speed * figures[_STOPPING] / 1000
    ahead = chord * math.cos(half) + rolled * math.cos(turned)
    return ahead, chord * math.sin(half) + rolled * math.sin(turned)


def _residuals(figures: Sequence[float], rows: Rows) -> list[float]:
    """How far the readings are from what a car with these figures does, in times of their errors."""
    found = []
    for move, reading in rows:
        error = PROTRACTOR_DEG if move.turns else RULER_MM
        found += [(read - shown) / error for read, shown in zip(reading, _shown(move, figures), strict=True)]
    return found


def _fitted(figures: list[float], free: Sequence[int], rows: Rows) -> list[list[float]]:
    """Move the free ones of the figures to the least squares; return their covariance."""
    covariance: list[list[float]] = []
    for _ in range(_STEPS):
        residuals = _residuals(figures, rows)
        slopes = []
        for place in free:
            changed = list(figures)
            changed[place] += _STEP
            changes = _residuals(changed, rows)
            slopes.append([(before - after) / _STEP for before, after in zip(residuals, changes, strict=True)])
        covariance = _inverse([[_dot(row, column) for column in slopes] for row in slopes])
        gradient = [_dot(slope, residuals) for slope in slopes]
        for place, row in zip(free, covariance, strict=True):
            figures[place] += _dot(row, gradient)
    return covariance


def _misfit(figures: Sequence[float], rows: Rows) -> float:
    """By how many times their errors the readings differ from the model. Raises MotorcadeError where that is absurd."""
    residuals = _residuals(figures, rows)
    misfit = math.sqrt(_dot(residuals, residuals) / (len(residuals) - len(figures)))
    if misfit > _MOST_MISFIT:
        off = {move.key: math.hypot(*_residuals(figures, [(move, reading)])) for move, reading in rows}
        worst = max(off, key=lambda key: off[key])
        raise InputError("readings-disagree", move=_MOVES[worst].title)
    return misfit


def _inverse(matrix: Sequence[Sequence[float]]) -> list[list[float]]:
    """The inverse of a symmetric matrix whose eigenvalues are above 0, so that no pivot is 0 (Gauss and Jordan)."""
    size = len(matrix)
    rows = [[*row, *(float(place == number) for place in range(size))] for number, row in enumerate(matrix)]
    for column in range(size):
        pivot = rows[column][column]
        rows[column] = [value / pivot for value in rows[column]]
        for number, row in enumerate(rows):
            if number != column:
                factor = row[column]
                rows[number] = [value - factor * other for value, other in zip(row, rows[column], strict=True)]
    return [row[size:] for row in rows]


def _dot(row: Sequence[float], column: Sequence[float]) -> float:
    return sum(value * other for value, other in zip(row, column, strict=True))


def _mean(values: Iterable[float]) -> float:
    found = list(values)
    return sum(found) / len(found)


def measured_profile(found: Calibration, base: Profile, name: str, equal: bool = False) -> Profile:
    """Return ``base`` with what was measured, in whole numbers as profiles have them. Raises MotorcadeError.

    Args:
        found: what was measured of a car that drives with the duties of ``base``.
        base: a profile.
        name: the new one's.
        equal: whether it is the profile of the same car with the duties that make both wheels equal. It drives
            straight, and as fast as its slower wheel turned.
    """
    duties = [base.wheels.left_duty_percent, base.wheels.right_duty_percent]
    drift = found.drift_mrad_per_m.value
    share = 1.0
    if equal:
        shares = (found.left_percent, found.right_percent)
        duties = [max(1, round(duty * percent / 100)) for duty, percent in zip(duties, shares, strict=True)]
        # The slower wheel keeps its duty, and both then turn as it did. What was measured is the mean of both.
        ratio = min(shares) / 100
        drift = 0.0
        share = 2 * ratio / (1 + ratio)
    return with_figures(
        base,
        name,
        speeds_mm_s=(0, *(round(figure.value * share) for figure in found.speeds_mm_s)),
        turn_rates_deg_s=(0, *(round(figure.value * share) for figure in found.turn_rates_deg_s)),
        wheels={
            "drift_mrad_per_m": round(drift),
            "stopping_ms": round(found.stopping_ms.value),
            "left_duty_percent": duties[0],
            "right_duty_percent": duties[1],
        },
    )


def with_figures(base: Profile, name: str, **figures: Any) -> Profile:
    """Return ``base`` with another name and other figures, by their keys. Raises MotorcadeError where one can't be."""
    document = {**asdict(base), **figures}
    del document["name"]
    return profile_from_dict(document, name)


def profile_text(profile: Profile) -> str:
    """Return the TOML of a profile."""
    document = asdict(profile)
    del document["name"]
    lines = [f"{key} = {_toml(value)}" for key, value in document.items() if not isinstance(value, dict)]
    for key, part in document.items():
        if isinstance(part, dict):
            lines += ["", f"[{key}]", *(f"{name} = {_toml(value)}" for name, value in part.items())]
    return "\n".join(lines) + "\n"


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return str(list(value)) if isinstance(value, tuple) else str(value)
