"""Draw a mat and its cars on Matplotlib's axes, for pictures and films; give the texts of pictures."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import numpy as np
from matplotlib import rc_context, rcParams
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, LineCollection, PolyCollection
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.patches import Circle, Polygon, Rectangle
from numpy.typing import ArrayLike, NDArray

from motorcade.engine.moment import Moment
from motorcade.engine.pictures import LEDS
from motorcade.errors import Phrase
from motorcade.locales import FIRST, catalogue
from motorcade.mats.model import path_of
from motorcade.runs.recording import Description, rgb

_PERSON_M = 0.3
_WALL = "#3a3a3a"
_SOLID = "#b5b5b5"
_PERSON = "#5b8fd6"
_BED = "#b9bdc4"
_DARK = "#17181c"
# A road as wide as the page draws it, under each line that is no wider than this.
_ROAD_M = 0.2
_WIDEST_M = 0.1
_LEAST_POINTS = 1.6
_LEAST_LEADER_POINTS = 5.0
_DETAIL_POINTS = 7

# The colours that do not depend on words.
PLAIN = np.array([rgb(colour) for colour in (_WALL, _SOLID, _PERSON, _BED, _DARK, "#202020", *LEDS)], np.float32)

# Fonts with Chinese letters, where Matplotlib's own has none.
_CHINESE_FONTS = (
    *("Noto Sans CJK SC", "Noto Sans CJK JP", "Noto Sans SC", "Source Han Sans SC", "Droid Sans Fallback"),
    *("WenQuanYi Micro Hei", "WenQuanYi Zen Hei", "Microsoft YaHei", "SimHei", "PingFang SC", "Arial Unicode MS"),
)
_language: ContextVar[str] = ContextVar("picture_language", default=FIRST)

Box = tuple[float, float, float, float]


def picture_text(key: str, **details: Any) -> str:
    """A text of a picture: the phrase ``key`` in the language of `pictures_in`, English outside of it."""
    return Phrase(key, **details).sentence(_language.get())


@contextmanager
def pictures_in(language: str) -> Iterator[str]:
    """Write the texts of pictures in ``language`` while the block runs; in English where no font has its letters.

    Yields the language that is written.
    """
    letters = {ord(letter) for letter in catalogue(language)["language"] if letter.isalpha()}
    family = next((font for font in ("", *_CHINESE_FONTS) if _has_letters(font, letters)), None)
    if family is None:
        language = FIRST
    families = list(rcParams["font.family"])
    if family:
        families.append(family)
    token = _language.set(language)
    try:
        with rc_context({"font.family": families}):
            yield _language.get()
    finally:
        _language.reset(token)


def _has_letters(family: str, letters: set[int]) -> bool:
    """Whether an installed font family has all ``letters``; the usual family where none is named."""
    try:
        path = findfont(FontProperties(family=[family] if family else None), fallback_to_default=not family)
    except ValueError:
        return False
    return letters <= get_font(path).get_charmap().keys()


def bounding_box(about: Description, moments: Iterable[Moment]) -> Box:
    """Find the smallest box that holds the mat and the cars of all ``moments``: left, bottom, right, top in metres."""
    points = [(0.0, 0.0), about.mat.size_m] if about.mat.size_m else []
    for x, y, radius_m in about.mat.discs:
        points += [(x - radius_m, y - radius_m), (x + radius_m, y + radius_m)]
    points += [corner for corners in about.mat.polygons for corner in corners]
    points += [(x, y) for x0, y0, x1, y1 in about.mat.walls for x, y in ((x0, y0), (x1, y1))]
    points += [(x, y) for person in about.mat.people for _, x, y in person.path]
    radius_m = about.diameter_m / 2
    for moment in moments:
        points.append((float(moment.x_m.min()) - radius_m, float(moment.y_m.min()) - radius_m))
        points.append((float(moment.x_m.max()) + radius_m, float(moment.y_m.max()) + radius_m))
    xs, ys = zip(*(points or [(0.0, 0.0), (1.0, 1.0)]), strict=True)
    return min(xs), min(ys), max(xs), max(ys)


def draw_mat(axes: Axes, about: Description) -> None:
    """Draw the mat's edge, roads, walls and obstacles, and label the axes in metres."""
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    axes.grid(alpha=0.3)
    axes.set_axisbelow(True)
    if about.mat.size_m:
        style = {"linewidth": 3.0} if about.mat.walled else {"linewidth": 1.0, "linestyle": "--"}
        axes.add_patch(Rectangle((0, 0), *about.mat.size_m, fill=False, edgecolor=_WALL, **style))
    _draw_marks(axes, about)
    for x, y, radius_m in about.mat.discs:
        axes.add_patch(Circle((x, y), radius_m, facecolor=_SOLID, edgecolor=_WALL))
    for corners in about.mat.polygons:
        axes.add_patch(Polygon(corners, facecolor=_SOLID, edgecolor=_WALL))
    walls = [[(x0, y0), (x1, y1)] for x0, y0, x1, y1 in about.mat.walls]
    axes.add_collection(LineCollection(walls, colors=_WALL, linewidths=3, capstyle="round"))


def _draw_marks(axes: Axes, about: Description) -> None:
    """Draw what is dark on the floor, and a bed under lines: all beds first, so that roads that cross are one."""
    paths = [(np.array(path_of(line)), line.width_m) for line in about.mat.lines]
    for path, width_m in paths:
        if width_m <= _WIDEST_M:
            _draw_band(axes, path, _ROAD_M, _BED, 0.5)
    for path, width_m in paths:
        _draw_band(axes, path, width_m, _DARK, 0.6)
    for x, y, radius_m in about.mat.spots:
        axes.add_patch(Circle((x, y), radius_m, facecolor=_DARK, zorder=0.6))
    for corners in about.mat.patches:
        axes.add_patch(Polygon(corners, facecolor=_DARK, zorder=0.6))


def _draw_band(axes: Axes, path: NDArray[np.float64], width_m: float, colour: str, zorder: float) -> None:
    """Draw a band of a width in metres along a path: a quadrangle for each stretch, a circle at each point."""
    along = np.diff(path, axis=0)
    length = np.hypot(along[:, 0], along[:, 1])[:, None]
    aside = np.column_stack([-along[:, 1], along[:, 0]]) / np.where(length, length, 1) * width_m / 2
    begin = path[:-1]
    end = path[1:]
    sides = np.stack([begin + aside, end + aside, end - aside, begin - aside], axis=1)
    axes.add_collection(PolyCollection(list(sides), facecolors=colour, linewidths=0, zorder=zorder))
    _circles(axes, [width_m], zorder, facecolors=colour, linewidths=0).set_offsets(path)


def show_box(axes: Axes, box: Box) -> None:
    """Make the axes show at least ``box`` and a margin around it."""
    left, bottom, right, top = box
    axes.update_datalim([(left, bottom), (right, top)])
    axes.margins(0.05)
    axes.autoscale_view()


class CarArtists:
    """Draw all cars as a few collections, so that thousands are drawn at once.

    The axes must have their limits before: cars that would be very small are drawn larger than they are.
    """

    def __init__(self, axes: Axes, about: Description):
        metre = axes.transData.transform([(0, 0), (1, 0)])
        points_per_m = float(metre[1, 0] - metre[0, 0]) * 72 / axes.figure.dpi
        self._is_detailed = about.diameter_m * points_per_m >= _DETAIL_POINTS
        self._radius_m = about.diameter_m / 2
        self._leads = about.is_leader()
        # Leaders are drawn last, so that no crowd hides them.
        self._order = np.argsort(self._leads, kind="stable")
        widths: Any = 0.0
        if self._is_detailed:
            widths = np.where(self._leads[self._order], 1.6, 0.8)
        least = np.where(self._leads[self._order], _LEAST_LEADER_POINTS, _LEAST_POINTS) / points_per_m
        wide_m = np.maximum(about.diameter_m, least)
        self.bodies = _circles(axes, wide_m, 3.0, linewidths=widths, edgecolors="#202020")
        self._lamps = _circles(axes, [about.diameter_m * 0.45], 3.2, linewidths=0)
        self._people = _circles(axes, [_PERSON_M], 2.9, facecolors=_PERSON, alpha=0.7)
        self._noses = LineCollection([], colors="#202020", linewidths=1.4, zorder=3.1, capstyle="round")
        axes.add_collection(self._noses, autolim=False)
        self._led_colours = np.array([(*rgb(led), 1.0) for led in LEDS] + [(0.0, 0.0, 0.0, 0.0)])
        self._about = about
        self.artists = (self._people, self.bodies, self._noses, self._lamps)

    def show(self, moment: Moment, colours: NDArray[np.float32]) -> None:
        """Move the cars to their positions at a moment; ``colours`` has a row for each."""
        places = np.column_stack([moment.x_m, moment.y_m]).astype(float)
        order = self._order
        self.bodies.set_offsets(places[order])
        self.bodies.set_facecolor(colours[order])  # type: ignore[arg-type]
        if self._is_detailed:
            ahead = np.column_stack([np.cos(moment.heading), np.sin(moment.heading)]) * self._radius_m
            self._noses.set_segments(np.stack([places, places + ahead], axis=1))  # type: ignore[arg-type]
            lit = moment.led < len(LEDS)
            self._lamps.set_offsets(places[lit])
            self._lamps.set_facecolor(self._led_colours[moment.led[lit]])  # type: ignore[arg-type]
        self._people.set_offsets(self._about.people_at(moment.t_ms) or np.empty((0, 2)))


def _circles(axes: Axes, wide_m: ArrayLike, zorder: float, **style: Any) -> EllipseCollection:
    """Circles whose positions are set later."""
    nowhere = np.empty((0, 2))
    circles = EllipseCollection(
        wide_m, wide_m, 0, units="xy", offsets=nowhere, offset_transform=axes.transData, zorder=zorder, **style
    )
    axes.add_collection(circles, autolim=False)
    return circles
