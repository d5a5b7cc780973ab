"""Mats that a page sends."""

from typing import Any

from motorcade.errors import MotorcadeError, Phrase
from motorcade.mats.document import mat_of
from motorcade.mats.model import Mat
from motorcade.service.errors import StudioError, reason_of


def mat_from(document: Any, most_cars: int) -> Mat:
    """The mat in a page's ``document``. Raises StudioError."""
    # Before anything is placed: a crowd is one line, yet may be millions.
    count = _cars_in(document)
    if count > most_cars:
        raise StudioError("too-many-cars", count=count, most=most_cars)
    try:
        return mat_of(document, Phrase("mat-of-page"))
    except MotorcadeError as problem:
        raise StudioError("bad-mat", reason=reason_of(problem)) from None


def _cars_in(document: Any) -> float:
    """How many cars the document speaks of; 0 where it is none, which its own check finds."""
    if not isinstance(document, dict):
        return 0
    cars, crowds = document.get("car"), document.get("crowd")
    count: float = len(cars) if isinstance(cars, list) else 0
    for crowd in crowds if isinstance(crowds, list) else ():
        crowd_cars = crowd.get("cars") if isinstance(crowd, dict) else None
        count += crowd_cars if isinstance(crowd_cars, int | float) else 0
    return count
