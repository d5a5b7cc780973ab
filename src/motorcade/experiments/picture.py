"""Draw a sweep's table: a measure against one parameter, or over two."""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import NDArray

from motorcade.errors import MotorcadeError
from motorcade.experiments.run import read_rows
from motorcade.experiments.spec import NEVER, Sample, Sweep
from motorcade.experiments.task import MEASURES
from motorcade.runs.drawing import picture_text
from motorcade.runs.recording import PICTURE_ENDINGS, check_writable

_NAMED = ("program", "mat")
_MOST_LINES = 8
_MOST_PLACES = 40  # along an axis; more values are put into bins
_MOST_BINS = 24
_MOST_TICKS = 12
_MOST_LETTERS = 80  # of all names along an axis; more are slanted
_LINE_OFFSET = 0.05  # between the lines of different programs and mats, where the axis has names
_LOWEST, _HIGHEST = 10, 90  # percentiles of the band

Numbers = NDArray[np.float64]


def draw_sweep(sweep: Sweep, table: Path, picture: Path, x: str, y: str, colour: str = "") -> None:
    """Draw columns of the table of ``sweep`` into a PNG, SVG or PDF file, as its ending says.

    Call `check_picture` before.

    Args:
        x: a parameter, ``program`` or ``mat``.
        y: a measure, whose mean and middle range are drawn along ``x``, a line for each program and mat. With a
            ``colour``, another parameter.
        colour: a measure, whose mean is drawn over ``x`` and ``y``.

    Raises:
        MotorcadeError: the table is damaged.
        OSError: the table can't be read, or the picture can't be written.
    """
    columns = list(dict.fromkeys([x, y, *([colour] if colour else ["program", "mat"])]))
    data = read_rows(table, columns)
    figure = Figure(figsize=(8, 5.5), layout="constrained")
    axes = figure.add_subplot()
    if colour:
        _heat(sweep, figure, axes, data, (x, y, colour))
    else:
        _lines(sweep, axes, data, x, y)
    figure.savefig(picture, dpi=120)


def check_picture(sweep: Sweep, picture: Path, x: str, y: str, colour: str = "") -> None:
    """Raise MotorcadeError unless `draw_sweep` can draw such a picture of this sweep."""
    check_writable(picture, PICTURE_ENDINGS)
    parameters = [*_NAMED, "seed", *sweep.points.parameters]

    def check_option(option: str, value: str, allowed: Iterable[str]) -> None:
        allowed = list(allowed)
        if value not in allowed:
            raise MotorcadeError("option-not-allowed", option=option, value=f"'{value}'", allowed=", ".join(allowed))

    check_option("--x", x, parameters)
    if colour:
        check_option("--y", y, (each for each in parameters if each != x))
        check_option("--colour", colour, MEASURES)
        return
    if y in parameters:
        raise MotorcadeError("picture-needs-colour", value=y, allowed=", ".join(MEASURES))
    check_option("--y", y, MEASURES)
    lines = (x == "program" or len(sweep.programs)) * (x == "mat" or len(sweep.mats))
    if lines > _MOST_LINES:
        raise MotorcadeError("picture-has-too-many-lines", count=lines, most=_MOST_LINES)


@dataclass(frozen=True)
class _Axis:
    """The places of values along an axis: one for each value, or bins.

    Attributes:
        label: of the axis.
        of: each run's place.
        edges: of the places.
        names: of the places, where the axis is a list; else it is a scale.
        logarithmic: whether the scale is.
    """

    label: str
    of: NDArray[np.int64]
    edges: Numbers
    names: tuple[str, ...] = ()
    logarithmic: bool = False

    @property
    def places(self) -> int:
        return len(self.edges) - 1

    @property
    def middles(self) -> Numbers:
        below, above = self.edges[:-1], self.edges[1:]
        return np.sqrt(below * above) if self.logarithmic else (below + above) / 2

    def show(self, axis_of: Any, set_scale: Callable[[str], None]) -> None:
        axis_of.set_label_text(self.label)
        if self.names:
            every = math.ceil(self.places / _MOST_TICKS)
            slant = 20 if sum(map(len, self.names[::every])) > _MOST_LETTERS else 0
            axis_of.set_ticks(range(0, self.places, every), self.names[::every], rotation=slant)
            return
        if self.logarithmic:
            set_scale("log")
            axis_of.set_major_locator(LogLocator(subs=(1, 2, 5)))
            axis_of.set_minor_formatter(NullFormatter())
        axis_of.set_major_formatter("{x:g}")


def _axis(sweep: Sweep, name: str, column: pa.ChunkedArray, bins: int) -> _Axis:
    """Find the places of the values of a column; drawn values, and more than _MOST_PLACES, are put into ``bins``."""
    encoded = column.combine_chunks().dictionary_encode(null_encoding="encode")
    different = encoded.dictionary.to_pylist()
    limits = sweep.points.ranges.get(name) if isinstance(sweep.points, Sample) else None
    numbers = all(isinstance(each, int | float) for each in different)
    if numbers and (len(different) > _MOST_PLACES or (limits and isinstance(different[0], float))):
        logarithmic = bool(limits and limits.logarithmic)
        values = column.to_numpy()
        edges = (np.geomspace if logarithmic else np.linspace)(values.min(), values.max(), bins + 1).astype(np.float64)
        of = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, bins - 1)
        return _Axis(name, of, edges, logarithmic=logarithmic)
    order = list(range(len(different)))
    if not any(isinstance(each, str) for each in different):
        order.sort(key=lambda index: (different[index] is None, different[index]))
    names = tuple(_shown(different[index]) for index in order)
    return _Axis(name, np.argsort(order)[encoded.indices.to_numpy()], np.arange(len(order) + 1.0) - 0.5, names)


def _shown(value: object) -> str:
    if value is None:
        return NEVER
    return f"{value:g}" if isinstance(value, float) else str(value)


def _heat(sweep: Sweep, figure: Figure, axes: Axes, data: pa.Table, names: tuple[str, str, str]) -> None:
    # Few enough fields that nearly each contains some points.
    bins = int(np.clip(math.sqrt(sweep.points.count / 6), 4, _MOST_BINS))
    across, up = (_axis(sweep, name, data[name], bins) for name in names[:2])
    values = data[names[2]].to_numpy().astype(np.float64)
    known = ~np.isnan(values)
    place = (up.of * across.places + across.of)[known]
    count = np.bincount(place, minlength=up.places * across.places)
    total = np.bincount(place, values[known], minlength=up.places * across.places)
    with np.errstate(invalid="ignore"):
        mean = (total / count).reshape(up.places, across.places)
    mesh = axes.pcolormesh(across.edges, up.edges, np.ma.masked_invalid(mean), cmap="viridis")
    figure.colorbar(mesh, ax=axes, label=picture_text("picture-mean", measure=_measure(names[2])))
    across.show(axes.xaxis, axes.set_xscale)
    up.show(axes.yaxis, axes.set_yscale)
    axes.set_title(picture_text("picture-runs-a-field", runs=len(values), each=_each(count[count > 0])))


def _lines(sweep: Sweep, axes: Axes, data: pa.Table, x: str, y: str) -> None:
    across = _axis(sweep, x, data[x], int(np.clip(sweep.points.count / 10, 4, _MOST_BINS)))
    values = data[y].to_numpy().astype(np.float64)
    counts: list[int] = []
    for number, (name, belongs) in enumerate(_lines_of(sweep, data, x)):
        chosen = belongs & ~np.isnan(values)
        runs = [values[chosen & (across.of == place)] for place in range(across.places)]
        shown = [place for place, some in enumerate(runs) if len(some)]
        counts += [len(runs[place]) for place in shown]
        where = across.middles[shown] + (_LINE_OFFSET * number if x in _NAMED else 0)
        mean = [runs[place].mean() for place in shown]
        low, high = ([np.percentile(runs[place], share) for place in shown] for share in (_LOWEST, _HIGHEST))
        if x in _NAMED:  # no line between names
            colour = f"C{number}"
            axes.vlines(where, low, high, color=colour, alpha=0.5)
            axes.plot(where, mean, "o", color=colour, label=name)
            axes.margins(x=0.5 / len(where))
        else:
            (line,) = axes.plot(where, mean, marker="o", markersize=4, label=name)
            axes.fill_between(where, low, high, color=line.get_color(), alpha=0.2, linewidth=0)
    across.show(axes.xaxis, axes.set_xscale)
    axes.set_ylabel(_measure(y))
    share = _HIGHEST - _LOWEST
    axes.set_title(picture_text("picture-runs-a-point", runs=len(values), each=_each(np.array(counts)), share=share))
    axes.grid(alpha=0.3)
    if axes.get_legend_handles_labels()[1]:
        axes.legend()


def _lines_of(sweep: Sweep, data: pa.Table, x: str) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """Yield the label of each line, and which runs belong to it: one line for each program and mat."""
    programs: tuple[str, ...] = sweep.programs if x != "program" else ("",)
    mats: tuple[str, ...] = sweep.mats if x != "mat" else ("",)
    for program, mat in product(programs, mats):
        belongs = np.ones(len(data), dtype=np.bool_)
        for kind, name in (("program", program), ("mat", mat)):
            if name:
                belongs &= pc.equal(data[kind], name).to_numpy()
        names = [name for name, others in ((program, programs), (mat, mats)) if len(others) > 1]
        both = picture_text("picture-program-on-mat", program=program, mat=mat)
        yield both if len(names) > 1 else "".join(names), belongs


def _each(counts: NDArray[np.int64]) -> str:
    if not len(counts):
        return "0"
    lowest, highest = int(counts.min()), int(counts.max())
    return f"{lowest:,}" if lowest == highest else picture_text("picture-from-to", lowest=lowest, highest=highest)


def _measure(name: str) -> str:
    return picture_text(f"picture-measure-{name}")
