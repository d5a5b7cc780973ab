"""Arguments that Python code gives: numbers of any kind become Python's own, and what is no such number is refused.

A number is what Python itself takes for one: an int or a float, or a value that can be turned into one without loss of
its meaning, such as NumPy's numbers, a Fraction or a Decimal. True and texts are none, nor is an array, even of length
1. What files and messages hold is checked elsewhere (`motorcade.config.check`): they have only Python's own numbers.
"""

import operator
from typing import Any, TypeVar

from motorcade.config.check import Text
from motorcade.errors import InputError, MotorcadeError, Phrase

MOST_SEED = (1 << 32) - 1
_LONGEST_SHOWN = 60
# What NumPy calls its kinds of numbers and of truth values.
_NUMBERS = "iuf"
_TRUTHS = "b"

Kind = TypeVar("Kind")


def plain(value: Any) -> Any:
    """Return a number of any kind as an int or a float, a truth value as a bool; all else as it is."""
    if type(value) in (int, float, bool) or getattr(value, "shape", ()) != ():
        return value
    kind = getattr(getattr(value, "dtype", None), "kind", "f")
    if kind == _TRUTHS:
        return bool(value)
    if kind not in _NUMBERS:
        return value
    try:
        return operator.index(value)
    except TypeError:
        pass
    try:
        return float(value) if hasattr(type(value), "__float__") else value
    except (TypeError, ValueError, OverflowError):
        return value


def to_whole(what: str, value: Any, least: int, most: int) -> int:
    """Return a whole number of any kind, such as 3, 3.0 or ``numpy.int64(3)``, as an int.

    Raises MotorcadeError, which calls the argument ``what``, unless it is one from ``least`` to ``most``.
    """
    number = plain(value)
    if isinstance(number, float) and number.is_integer():
        number = int(number)
    if type(number) is not int or not least <= number <= most:
        raise not_allowed(what, value, Phrase("whole-range", minimum=least, maximum=most))
    return number


def to_number(what: str, value: Any, least: float, most: float) -> float:
    """Return a number of any kind as an int or a float.

    Raises MotorcadeError, which calls the argument ``what``, unless it is one from ``least`` to ``most``.
    """
    number = plain(value)
    if type(number) not in (int, float) or not least <= number <= most:
        raise not_allowed(what, value, Phrase("number-range", minimum=least, maximum=most))
    result: float = number
    return result


def to_list(what: str, value: Any) -> list[Any]:
    """Return what a list, an array or another collection holds. Raises MotorcadeError, which calls it ``what``."""
    if not isinstance(value, str | dict):
        try:
            return list(value)
        except TypeError:
            pass
    raise not_allowed(what, value, Phrase("array"))


def to_truth(what: str, value: Any) -> bool:
    """Return True or False of any kind as a bool. Raises MotorcadeError, which calls the argument ``what``."""
    truth = plain(value)
    if not isinstance(truth, bool):
        raise not_allowed(what, value, "True, False")
    return truth


def to_function(what: str, value: Any) -> Any:
    """Return a function. Raises MotorcadeError, which calls the argument ``what``, where nobody can call it."""
    if not callable(value):
        raise not_allowed(what, value, Phrase("a-function"))
    return value


def instance_of(kind: type[Kind], what: str, value: Any) -> Kind:
    """Return ``value``. Raises MotorcadeError, which calls the argument ``what``, unless it is of that kind."""
    if not isinstance(value, kind):
        raise not_allowed(what, value, kind.__name__)
    return value


def not_allowed(what: str, value: Any, allowed: Text) -> MotorcadeError:
    """The error for an argument that is not allowed."""
    return InputError("option-not-allowed", option=what, value=_shown(value), allowed=allowed)


def _shown(value: Any) -> Text:
    """An argument as Python writes it, shortened, on one line."""
    try:
        text = " ".join(repr(value).split())
    except ValueError:  # thousands of digits
        return Phrase("very-long-number")
    return text if len(text) <= _LONGEST_SHOWN else text[: _LONGEST_SHOWN - 3] + "..."
