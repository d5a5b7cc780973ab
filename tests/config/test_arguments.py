"""Arguments that Python code gives: what counts as a number, and the sentence for the rest."""

import math
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

from motorcade.config.arguments import to_number, to_truth, to_whole
from motorcade.errors import MotorcadeError


@pytest.mark.parametrize(
    "given", [3, 3.0, np.int64(3), np.uint8(3), np.float32(3), np.array(3), Fraction(3), Decimal(3)]
)
def test_what_python_counts_as_a_whole_number_is_one(given):
    found = to_whole("car", given, 0, 3)
    assert (found, type(found)) == (3, int)


@pytest.mark.parametrize(
    ("given", "shown"),
    [
        (3.5, "3.5"),
        (4, "4"),
        (-1, "-1"),
        (math.nan, "nan"),
        (math.inf, "inf"),
        (np.float64("nan"), "np.float64(nan)"),
        (True, "True"),
        (np.True_, "np.True_"),
        ("3", "'3'"),
        (None, "None"),
        (np.array([3]), "array([3])"),
        (np.complex64(3), "np.complex64(3+0j)"),
    ],
)
def test_the_rest_is_refused_with_what_was_given_and_what_is_allowed(given, shown):
    with pytest.raises(MotorcadeError) as caught:
        to_whole("car", given, 0, 3)
    assert str(caught.value) == f"car is {shown}; allowed: a whole number from 0 to 3"


def test_a_number_of_thousands_of_digits_is_refused():
    with pytest.raises(MotorcadeError, match="car is a very long number; allowed"):
        to_whole("car", 10**5000, 0, 3)


def test_numbers_of_any_kind_become_pythons_own():
    for given in (np.float64(0.5), np.float32(0.5), Fraction(1, 2), Decimal("0.5")):
        found = to_number("seconds", given, 0, 1)
        assert (found, type(found)) == (0.5, float)
    for given in (math.nan, 1.5, np.array([0.5]), "0.5", True):
        with pytest.raises(MotorcadeError):
            to_number("seconds", given, 0, 1)


def test_truth_values_become_pythons_own():
    assert [to_truth("pose", given) for given in (np.True_, False)] == [True, False]
    for given in (1, "no", None, np.array([True])):
        with pytest.raises(MotorcadeError, match="allowed: True, False"):
            to_truth("pose", given)
