"""Draw plots of a run: one class for each kind, which takes the moments one by one and is drawn at the end."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from motorcade.engine.state import Moment
from motorcade.errors import MotorcadeError
from motorcade.runs.drawing import Cars, bounding_box, draw_mat, picture_text, show_box
from motorcade.runs.palette import FOLLOWERS, LEADER, WordColours, rgb
from motorcade.runs.recording import PICTURE_ENDINGS, Description, Progress, Recording, check_writable

_DPI = 120
_MOST_TRACKS = 1000
_MOST_POINTS = 1_000_000
_FEW_TRACKS = 30
_MOST_ROWS = 250
_MOST_COLUMNS = 1200
_MOST_NAMED = 8
_LONGEST_NAME = 48
_MOST_BINS = 120
# The legend is below the axes; its pad, in font sizes, leaves room for the label of the time axis.
_LEGEND: dict[str, Any] = {
    "loc": "upper left",
    "bbox_to_anchor": (0, 0),
    "borderaxespad": 4.8,
    "fontsize": 8,
    "frameon": False,
}
# The colour of each outcome of a frame that reached a car.
_OUTCOMES = {
    "heard": "#2ca02c",
    "undetected": "#bcbd22",
    "lost_collision": "#d62728",
    "lost_sending": "#ff7f0e",
    "lost_parity": "#9467bd",
    "lost_reserved": "#8c564b",
    "lost_check": "#e377c2",
    "deaf": "#9a9a9a",
}

T = TypeVar("T")


class Panel(Protocol):
    """One plot."""

    def take(self, moment: Moment) -> None:
        """Take the next moment of the run."""

    def draw(self, axes: Axes, name_of_word: Callable[[int], str]) -> None:
        """Draw the moments that were taken."""


class Thinned(Generic[T]):
    """Keep every n-th item of a series, and the last; n doubles whenever there are more than ``most`` items."""

    def __init__(self, most: int):
        self._most = most
        self._step = 1
        self._taken = 0
        self._kept: list[T] = []
        self._last: T | None = None

    def add(self, item: T) -> None:
        self._last = item
        if self._taken % self._step == 0:
            self._kept.append(item)
        self._taken += 1
        if len(self._kept) > self._most:
            self._kept = self._kept[::2]
            self._step *= 2

    def items(self) -> list[T]:
        if self._last is None or self._kept[-1] is self._last:
            return self._kept
        return [*self._kept, self._last]


class Tracks:
    """The cars' tracks on the mat, and their last positions."""

    def __init__(self, about: Description):
        self._about = about
        followers = np.setdiff1d(np.arange(about.cars), about.leaders)
        step = max(1, len(followers) // _MOST_TRACKS)
        self._drawn = np.concatenate([followers[::step], np.array(about.leaders, int)[:_MOST_TRACKS]]).astype(int)
        self._leads = np.isin(self._drawn, about.leaders)
        self._points: Thinned[NDArray[np.float32]] = Thinned(max(50, _MOST_POINTS // max(1, len(self._drawn))))
        self._last: Moment | None = None

    def take(self, moment: Moment) -> None:
        self._points.add(np.column_stack([moment.x_m[self._drawn], moment.y_m[self._drawn]]))
        self._last = moment

    def draw(self, axes: Axes, name_of_word: Callable[[int], str]) -> None:
        about, last = self._about, self._last
        if last is None:
            return
        draw_mat(axes, about)
        tracks = np.stack(self._points.items(), axis=1)
        left, bottom, right, top = bounding_box(about, [last])
        if tracks.size:
            low, high = tracks.min(axis=(0, 1)), tracks.max(axis=(0, 1))
            left, bottom = min(left, float(low[0])), min(bottom, float(low[1]))
            right, top = max(right, float(high[0])), max(top, float(high[1]))
        show_box(axes, (left, bottom, right, top))
        colours = self._colours()
        few = len(self._drawn) <= _FEW_TRACKS
        for leads in (False, True):
            which = self._leads == leads
            width, alpha = (2.2 if leads else 1.2, 0.9) if few else (1.2 if leads else 0.6, 0.9 if leads else 0.35)
            axes.add_collection(
                LineCollection(list(tracks[which]), colors=colours[self._drawn[which]], linewidths=width, alpha=alpha)
            )
        if few:
            xs, ys = tracks[:, 0].T
            axes.scatter(xs, ys, c=colours[self._drawn], marker="x", s=36, zorder=2.5)
        figure = axes.get_figure(root=True)
        if figure is not None:
            figure.draw_without_rendering()
        Cars(axes, about).show(last._replace(led=np.full_like(last.led, 4)), colours)
        axes.set_title(self._title(few))

    def _colours(self) -> NDArray[np.float32]:
        """A different colour for each follower where there are few; red for leaders."""
        own = FOLLOWERS if len(self._drawn) <= _FEW_TRACKS else FOLLOWERS[:1]
        cycle = np.array([rgb(colour) for colour in own], np.float32)
        leads = np.zeros(self._about.cars, bool)
        leads[list(self._about.leaders)] = True
        colours: NDArray[np.float32] = cycle[(np.cumsum(~leads) - 1) % len(cycle)]
        colours[leads] = rgb(LEADER)
        return colours

    def _title(self, few: bool) -> str:
        leaders = len(self._about.leaders)
        followers = self._about.cars - leaders
        t_s = self._last.t_ms / 1000 if self._last else 0
        title = picture_text(
            "picture-tracks",
            leaders=picture_text("picture-one-leader" if leaders == 1 else "picture-leaders", count=leaders),
            followers=picture_text("picture-one-follower" if followers == 1 else "picture-followers", count=followers),
            t_s=t_s,
        )
        if few:
            return picture_text("picture-tracks-few", title=title)
        drawn = len(self._drawn)
        return title if drawn == self._about.cars else picture_text("picture-tracks-some", title=title, count=drawn)


class Words:
    """Which car held which word when: a row for each car or group of cars, the nearest to the first leader lowest."""

    def __init__(self, about: Description):
        self._about = about
        self._colours = WordColours(about.images)
        self._cells: Thinned[tuple[int, NDArray[np.uint16]]] = Thinned(_MOST_COLUMNS)
        self._rows: NDArray[np.intp] | None = None
        self._distance_m: NDArray[np.float64] = np.zeros(0)

    def take(self, moment: Moment) -> None:
        if self._rows is None:
            self._rows = self._sort(moment)
        codes = self._colours.places(moment.word) * 2 + moment.runs
        kinds = len(self._colours.shades) * 2
        rows = int(self._rows.max()) + 1 if len(self._rows) else 0
        votes = np.bincount(self._rows * kinds + codes, minlength=rows * kinds).reshape(rows, kinds)
        self._cells.add((moment.t_ms, votes.argmax(axis=1).astype(np.uint16)))

    def draw(self, axes: Axes, name_of_word: Callable[[int], str]) -> None:
        times, columns = zip(*self._cells.items(), strict=True)
        codes = np.stack(columns, axis=1)
        shades = self._colours.shades.reshape(-1, 3)
        every_s = (times[-1] - times[0]) / 1000 / max(1, len(times) - 1) or 0.1
        extent = (times[0] / 1000, times[-1] / 1000 + every_s, 0.0, float(len(codes)))
        axes.imshow(shades[codes], extent=extent, origin="lower", aspect="auto", interpolation="nearest")
        self._label(axes, len(codes))
        self._name(axes, codes, name_of_word)

    def _sort(self, moment: Moment) -> NDArray[np.intp]:
        """The row of each car."""
        first = self._about.leaders[0] if self._about.leaders else 0
        away_m = np.hypot(moment.x_m - moment.x_m[first], moment.y_m - moment.y_m[first]).astype(float)
        order = np.lexsort((np.arange(len(away_m)), away_m))
        rank = np.empty(len(order), np.intp)
        rank[order] = np.arange(len(order))
        rows = min(len(order), _MOST_ROWS)
        self._distance_m = away_m[order][np.arange(rows) * len(order) // rows]
        placed: NDArray[np.intp] = rank * rows // len(order)
        return placed

    def _label(self, axes: Axes, rows: int) -> None:
        key = "picture-words" if rows == self._about.cars else "picture-words-rows"
        axes.set_title(picture_text(key, cars=self._about.cars, rows=rows))
        axes.set_xlabel(picture_text("picture-time"))
        digits = 2 if self._distance_m.max(initial=0) < 2 else 1
        ticks = np.unique(np.linspace(0, rows - 1, min(rows, 8)).round().astype(int))
        axes.set_yticks(ticks + 0.5, [f"{self._distance_m[tick]:.{digits}f}" for tick in ticks])
        axes.set_ylabel(picture_text("picture-distance"))

    def _name(self, axes: Axes, codes: NDArray[np.uint16], name_of_word: Callable[[int], str]) -> None:
        known = len(self._colours.words)
        seen = np.unique(codes // 2).tolist()
        words = [(self._call(code, name_of_word), code) for code in seen if code < known]
        named = words[:_MOST_NAMED]
        more = len(words) - len(named)
        if known in seen:
            named.append((picture_text("picture-no-word"), known))
        handles = [Patch(color=tuple(self._colours.shades[code, 1]), label=name) for name, code in named]
        if more:
            handles.append(Patch(color="none", label=picture_text("picture-more-words", count=more)))
        if handles:
            axes.legend(handles=handles, ncols=2, **_LEGEND)

    def _call(self, code: int, name_of_word: Callable[[int], str]) -> str:
        name = name_of_word(self._colours.words[code])
        name = name if len(name) <= _LONGEST_NAME else name[:_LONGEST_NAME] + "…"
        return name if code < self._colours.followers else picture_text("picture-leader-word", name=name)


class Air:
    """What happened to the frames that reached a car, and how many were sent."""

    def __init__(self, about: Description):
        self._counts: Thinned[tuple[int, Mapping[str, int]]] = Thinned(_MOST_COLUMNS)

    def take(self, moment: Moment) -> None:
        self._counts.add((moment.t_ms, moment.counts))

    def draw(self, axes: Axes, name_of_word: Callable[[int], str]) -> None:
        times, counts = zip(*self._counts.items(), strict=True)
        t_s = np.array(times) / 1000
        edges = np.linspace(t_s[0], max(t_s[-1], t_s[0] + 0.1), 1 + int(np.clip((t_s[-1] - t_s[0]), 1, _MOST_BINS)))
        rates = {name: self._rate(t_s, edges, name, counts) for name in ("frames", *_OUTCOMES)}
        rates["heard"] = np.maximum(rates["heard"] - rates["undetected"], 0)
        floor = np.zeros(len(edges) - 1)
        for name, colour in _OUTCOMES.items():
            if rates[name].any():
                top = floor + rates[name]
                text = picture_text(f"picture-air-{name}")
                axes.stairs(top, edges, baseline=floor, fill=True, color=colour, label=text)
                floor = top
        sent = axes.twinx()
        line = picture_text("picture-sent")
        sent.stairs(rates["frames"], edges, baseline=None, color="black", linewidth=1.2, label=line)
        sent.set_ylim(0, max(float(rates["frames"].max()), 1) * 1.15)
        sent.set_ylabel(picture_text("picture-sent-rate"))
        for each in (axes, sent):
            each.yaxis.set_major_formatter(lambda value, place: f"{value:,.6g}" if value < 1e6 else f"{value:,.0f}")
        axes.set_title(picture_text("picture-air"))
        axes.set_xlim(edges[0], edges[-1])
        axes.set_ylim(0, max(float(floor.max()), 1) * 1.15)
        axes.set_xlabel(picture_text("picture-time"))
        axes.set_ylabel(picture_text("picture-reception-rate"))
        handles = [*axes.get_legend_handles_labels()[0], *sent.get_legend_handles_labels()[0]]
        sent.legend(handles=handles, ncols=4, **_LEGEND)

    def _rate(
        self, t_s: NDArray[np.float64], edges: NDArray[np.float64], name: str, counts: tuple[Mapping[str, int], ...]
    ) -> NDArray[np.float64]:
        sums = np.interp(edges, t_s, [each.get(name, 0) for each in counts])
        rates: NDArray[np.float64] = np.diff(sums) / np.diff(edges)
        return rates


KINDS_OF_PLOT: dict[str, Callable[[Description], Panel]] = {"tracks": Tracks, "words": Words, "air": Air}


def draw_plots(
    recording: Recording,
    path: str | Path,
    kinds: Sequence[str] = tuple(KINDS_OF_PLOT),
    name_of_word: Callable[[int], str] = lambda word: f"0x{word:08X}",
    progress: Progress = lambda done_ms: None,
) -> None:
    """Write plots of a run to ``path``, in the format of its ending.

    Args:
        path: a PNG, SVG or PDF file.
        kinds: tracks (on the mat), words (which car held which word when), air (what happened to frames).
        name_of_word: gives a word's name in the legend.
        progress: called with the simulated time in ms that has been read.

    Raises:
        MotorcadeError: the recording holds no moment, or the picture can't be written.
    """
    path = Path(path)
    check_writable(path, PICTURE_ENDINGS)
    panels = [KINDS_OF_PLOT[kind](recording.about) for kind in kinds]
    moments = 0
    for moment in recording.moments():
        for panel in panels:
            panel.take(moment)
        progress(moment.t_ms)
        moments += 1
    if not moments:
        raise MotorcadeError("nothing-recorded", file=recording.name)
    figure = _figure(panels, name_of_word)
    try:
        figure.savefig(path, dpi=_DPI)
    except OSError as problem:
        raise MotorcadeError("run-file-unwritable", file=path, reason=problem.strerror or problem) from None


def _figure(panels: Sequence[Panel], name_of_word: Callable[[int], str]) -> Figure:
    """Put the panels on one figure: the first large at the left, the others beside it."""
    figure = Figure(figsize=(8, 6) if len(panels) == 1 else (15, 7.5), layout="constrained")
    places: list[Axes]
    if len(panels) == 1:
        places = [figure.add_subplot()]
    else:
        grid = figure.add_gridspec(len(panels) - 1, 2, width_ratios=(1.1, 1))
        places = [figure.add_subplot(grid[:, 0])]
        places += [figure.add_subplot(grid[row, 1]) for row in range(len(panels) - 1)]
    for panel, axes in zip(panels, places, strict=True):
        panel.draw(axes, name_of_word)
    return figure
