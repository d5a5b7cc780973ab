"""A moment as a map of characters, for terminals."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from motorcade.engine.moment import Moment
from motorcade.runs.box import Box
from motorcade.runs.description import Description
from motorcade.runs.palette import LEADER, WordColours, rgb

ARROWS = "→↗↑↖←↙↓↘"
PLAIN_ARROWS = ">/^\\</v\\"
WALL = "█"
PLAIN_WALL = "#"
PERSON = "P"
MANY = "+"
# A character is about twice as high as it is wide.
_HIGH = 2
_GREY = (0.55, 0.55, 0.55)


class CharacterMap(NamedTuple):
    """Rows from the top; ``colours`` holds red, green and blue from 0 to 1 for each character."""

    characters: NDArray[np.str_]
    colours: NDArray[np.float32]


class CharacterMaps:
    """Draws moments of a run, each into ``rows`` of ``columns`` characters that show at least ``box``.

    A car is an arrow that points where it faces; several in one place are their
    number, and a plus beyond nine. Colours are those of their words, leaders red.

    Args:
        plain: use ASCII characters only.
    """

    def __init__(self, about: Description, box: Box, columns: int, rows: int, plain: bool = False):
        left, bottom, right, top = box
        self._columns, self._rows = columns, rows
        self._wide_m = max((right - left) / columns, (top - bottom) / (rows * _HIGH), 1e-6) * 1.0001
        self._left = (left + right - columns * self._wide_m) / 2
        self._top = (bottom + top + rows * _HIGH * self._wide_m) / 2
        self._about = about
        self._arrows = np.array(list(PLAIN_ARROWS if plain else ARROWS))
        self._colours = WordColours(about.images)
        self._leads = np.zeros(about.cars, bool)
        self._leads[list(about.leaders)] = True
        self._still = np.full((rows, columns), " ")
        for x0, y0, x1, y1 in _lines(about):
            steps = 2 + int(2 * math.hypot(x1 - x0, y1 - y0) / self._wide_m)
            self._mark(np.linspace(x0, x1, steps), np.linspace(y0, y1, steps), PLAIN_WALL if plain else WALL)

    def draw(self, frame: Moment) -> CharacterMap:
        """The map of a moment."""
        characters = self._still.copy()
        colours = np.full((*characters.shape, 3), _GREY, np.float32)
        for x, y in self._about.people_at(frame.t_ms):
            row, column, inside = self._cells(np.array([x]), np.array([y]))
            characters[row[inside], column[inside]] = PERSON
        row, column, inside = self._cells(frame.x_m, frame.y_m)
        # Where several share a cell the last one counts: leaders come last.
        order = np.argsort(self._leads, kind="stable")
        order = order[inside[order]]
        row, column = row[order], column[order]
        here = np.zeros(characters.shape, np.intp)
        np.add.at(here, (row, column), 1)
        eighth = np.round(frame.heading[order] / (math.tau / 8)).astype(int) % 8
        number = here[row, column]
        digits = np.array([*"0123456789", MANY])
        shown = np.where((number == 1) | self._leads[order], self._arrows[eighth], digits[np.minimum(number, 10)])
        characters[row, column] = shown
        colours[row, column] = self._colours.of(frame.word, frame.runs)[order]
        leaders = self._leads[order]
        colours[row[leaders], column[leaders]] = rgb(LEADER)
        return CharacterMap(characters, colours)

    def _mark(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64], character: str) -> None:
        row, column, inside = self._cells(x_m, y_m)
        self._still[row[inside], column[inside]] = character

    def _cells(
        self, x_m: NDArray[np.floating], y_m: NDArray[np.floating]
    ) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.bool_]]:
        """Row and column of each place, and whether it is on the map."""
        column = np.floor((x_m - self._left) / self._wide_m).astype(np.intp)
        row = np.floor((self._top - y_m) / (self._wide_m * _HIGH)).astype(np.intp)
        return row, column, (row >= 0) & (row < self._rows) & (column >= 0) & (column < self._columns)


def _lines(about: Description) -> list[tuple[float, float, float, float]]:
    """All that stands on the mat, as straight lines."""
    outlines = list(about.polygons)
    if about.size_m and about.walled:
        wide, high = about.size_m
        outlines.append(((0, 0), (wide, 0), (wide, high), (0, high)))
    for x, y, radius_m in about.discs:
        turns = [math.tau * step / 16 for step in range(16)]
        outlines.append(tuple((x + radius_m * math.cos(turn), y + radius_m * math.sin(turn)) for turn in turns))
    sides = [(*a, *b) for corners in outlines for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    return [*about.walls, *sides]
