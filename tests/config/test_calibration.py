"""A car is measured: from what a ruler shows after six moves to its profile."""

import math
import random
from dataclasses import replace
from typing import NamedTuple

import pytest

from motorcade.config.calibration import MOVES, fit, measured_profile, profile_text, readings_of
from motorcade.config.profile import MeasuredWheels, built_in_profile, parse_profile
from motorcade.errors import MotorcadeError

_TICKS_A_S = 100
# What 3 s ahead at three speeds, 1 s ahead and two turns show of a car that drives straight and stops at once.
STRAIGHT = {
    "slow": [(300.0, 0.0)],
    "medium": [(600.0, 0.0)],
    "fast": [(900.0, 0.0)],
    "short": [(300.0, 0.0)],
    "left": [(270.0,)],
    "right": [(270.0,)],
}
_FAST, _LEFT = MOVES[2], MOVES[4]


class UnknownCar(NamedTuple):
    """A car with two wheels that nobody has measured; its wheels turn, tick by tick."""

    left_mm_s: list[float]
    right_mm_s: list[float]
    wheel_base_mm: float
    stopping_s: float

    def read(self, move, luck):
        """What a pupil reads after a move: within 2 mm and 2 degrees, in whole ones."""
        left, right = self.left_mm_s[move.level - 1], self.right_mm_s[move.level - 1]
        signs = {"forward": (1, 1), "left": (-1, 1), "right": (1, -1)}[move.direction]
        left, right = left * signs[0] / _TICKS_A_S, right * signs[1] / _TICKS_A_S
        x = y = heading = 0.0
        for _ in range(move.seconds * _TICKS_A_S):
            heading += (right - left) / self.wheel_base_mm
            x += (left + right) / 2 * math.cos(heading)
            y += (left + right) / 2 * math.sin(heading)
        rolled = (left + right) / 2 * _TICKS_A_S * self.stopping_s
        shown = (abs(math.degrees(heading)),)
        if not move.turns:
            shown = (x + rolled * math.cos(heading), y + rolled * math.sin(heading))
        return tuple(float(round(value + luck.uniform(-2, 2))) for value in shown)


def an_unknown_car(luck):
    power, differ = luck.uniform(0.6, 1.5), luck.uniform(-0.03, 0.03)
    speeds = [power * luck.uniform(0.92, 1.08) * speed for speed in (100, 200, 300)]
    left, right = ([speed * (1 + sign * differ) for speed in speeds] for sign in (-1, 1))
    return UnknownCar(left, right, luck.uniform(80, 170), luck.uniform(0, 0.15))


def test_200_cars_with_unknown_errors_are_fitted_within_3_percent():
    luck = random.Random(57)
    for _ in range(200):
        car = an_unknown_car(luck)
        found = fit({move.key: [car.read(move, luck)] for move in MOVES})
        speeds = [(left + right) / 2 for left, right in zip(car.left_mm_s, car.right_mm_s, strict=True)]
        rates = [math.degrees(2 * speed / car.wheel_base_mm) for speed in speeds]
        for figure, true in zip(found.speeds_mm_s + found.turn_rates_deg_s, speeds + rates, strict=True):
            assert figure.value == pytest.approx(true, rel=0.03)
            assert abs(figure.value - true) < 3 * figure.uncertainty
        slower = min(car.left_mm_s[0], car.right_mm_s[0])
        assert found.left_percent == pytest.approx(100 * slower / car.left_mm_s[0], rel=0.03)
        assert found.right_percent == pytest.approx(100 * slower / car.right_mm_s[0], rel=0.03)
        # Where a drive of a second ends: what rolls on counts with the speed.
        way = found.speeds_mm_s[2].value * (1 + found.stopping_ms.value / 1000)
        assert way == pytest.approx(speeds[2] * (1 + car.stopping_s), rel=0.03)
        bent = (car.right_mm_s[0] - car.left_mm_s[0]) / speeds[0] / car.wheel_base_mm * 1e6
        assert found.drift_mrad_per_m.value == pytest.approx(bent, abs=3 * found.drift_mrad_per_m.uncertainty)


def test_uncertainty_grows_where_readings_differ_and_shrinks_with_their_number():
    once = fit(STRAIGHT)
    often = fit({key: readings * 9 for key, readings in STRAIGHT.items()})
    assert often.speeds_mm_s[2].uncertainty == pytest.approx(once.speeds_mm_s[2].uncertainty / 3, rel=0.01)
    uneven = {**STRAIGHT, "fast": [(840.0, 0.0), (960.0, 0.0)]}
    assert fit(uneven).speeds_mm_s[2].uncertainty > 1.5 * once.speeds_mm_s[2].uncertainty


def test_a_car_that_seems_to_stop_before_it_is_told_to_stops_at_once():
    found = fit({**STRAIGHT, "short": [(294.0, 0.0)]})
    assert found.stopping_ms.value == 0
    assert found.stopping_ms.uncertainty > 10
    assert found.speeds_mm_s[2].value == pytest.approx(300, rel=0.01)


def test_the_profile_keeps_what_was_not_measured_and_can_be_read_again():
    base = built_in_profile("classroom")
    profile = measured_profile(fit(STRAIGHT), base, "mine.toml")
    assert profile.speeds_mm_s == base.speeds_mm_s
    assert profile.turn_rates_deg_s == base.turn_rates_deg_s
    assert (profile.infrared, profile.body) == (base.infrared, base.body)
    bent = measured_profile(fit({**STRAIGHT, "fast": [(880.0, -120.0)]}), base, "mine.toml")
    assert bent.wheels.drift_mrad_per_m < 0
    assert parse_profile(profile_text(bent), "mine.toml") == bent
    assert bent.wheels != MeasuredWheels()


def test_a_car_with_the_duties_for_equal_wheels_drives_as_the_profile_written_for_it_says():
    """The speed of its wheels is as high as the duty is."""
    luck = random.Random(75)
    base = replace(built_in_profile("classroom"), wheels=MeasuredWheels(right_duty_percent=95))
    for _ in range(20):
        car = an_unknown_car(luck)
        found = fit({move.key: [car.read(move, luck) for _ in range(9)] for move in MOVES})
        equal = measured_profile(found, base, "mine.toml", equal=True)
        shares = equal.wheels.left_duty_percent / 100, equal.wheels.right_duty_percent / 95
        left, right = (
            [speed * share for speed in speeds]
            for speeds, share in zip((car.left_mm_s, car.right_mm_s), shares, strict=True)
        )
        again = car._replace(left_mm_s=left, right_mm_s=right)
        found = fit({move.key: [again.read(move, luck) for _ in range(9)] for move in MOVES})
        assert equal.wheels.drift_mrad_per_m == 0
        # A percent of a duty is the least step.
        assert max(found.left_percent, found.right_percent) - min(found.left_percent, found.right_percent) < 1.5
        measured = measured_profile(found, equal, "mine.toml")
        assert measured.speeds_mm_s[1:] == pytest.approx(equal.speeds_mm_s[1:], rel=0.03)
        assert measured.turn_rates_deg_s[1:] == pytest.approx(equal.turn_rates_deg_s[1:], rel=0.03)
        assert (measured.wheels.left_duty_percent, measured.wheels.right_duty_percent) == (
            equal.wheels.left_duty_percent,
            equal.wheels.right_duty_percent,
        )


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"slow": [(10.0, 0.0)]}, "slowly ahead for 3 s': 1.0 cm; a car goes 2 to 1000 cm"),
        ({"slow": [(math.nan, 0.0)]}, "slowly ahead"),
        ({"medium": [(math.inf, 0.0)]}, "ahead for 3 s"),
        ({"fast": [(300.0, 800.0)]}, "in a circle"),
        ({"fast": [(-900.0, 0.0)]}, "in a circle"),
        ({"medium": [(300.0, 0.0)]}, "no farther than in the move 'slowly"),
        ({"short": [(890.0, 0.0)]}, "In one second 89 cm, in three seconds 90 cm"),
        ({"left": [(0.0,)]}, "turn left for 3 s': 0.0°"),
        ({"left": [(math.nan,)]}, "turn left for 3 s"),
        ({"left": [(90.0,)]}, "by 90° to the left and by 270° to the right"),
        ({"right": []}, "turn right for 3 s': nothing is measured yet"),
        ({"slow": [(280.0, 150.0)], "fast": [(800.0, -400.0)]}, "don't fit together"),
    ],
)
def test_what_no_car_can_have_done_is_refused_in_a_sentence(changed, said):
    with pytest.raises(MotorcadeError, match=said) as refused:
        fit({**STRAIGHT, **changed})
    assert refused.value.sentence("zh") != refused.value.sentence("en")


def test_people_write_centimetres_with_either_point_and_degrees():
    assert readings_of(_FAST, " 88,5  -3 ；87") == [(885, -30), (870, 0)]
    assert readings_of(_FAST, "88.5") == [(885, 0)]
    assert readings_of(_LEFT, "265; 262") == [(265,), (262,)]
    for move, text in ((_FAST, ""), (_FAST, "far"), (_FAST, "1 2 3"), (_LEFT, "265 3"), (_LEFT, "9" * 999 + "x")):
        with pytest.raises(MotorcadeError, match="such as"):
            readings_of(move, text)
