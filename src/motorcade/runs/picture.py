"""Pictures of a run: where cars drove, which words they held, and what became of their frames."""

from collections.abc import Callable, Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from motorcade.runs.plots import KINDS_OF_PLOT, Panel
from motorcade.runs.recording import PICTURES, Progress, Recording, RecordingError, check_writable

_DPI = 120


def draw_tracks(recording: Recording, path: str | Path, progress: Progress = lambda done_ms: None) -> None:
    """Write a picture of the cars' tracks and where they ended; see `draw_plots`."""
    draw_plots(recording, path, ["tracks"], progress=progress)


def draw_plots(
    recording: Recording,
    path: str | Path,
    kinds: Sequence[str] = tuple(KINDS_OF_PLOT),
    name_of_word: Callable[[int], str] = lambda word: f"0x{word:08X}",
    progress: Progress = lambda done_ms: None,
) -> None:
    """Write plots of a run to ``path``; its ending says the format.

    Args:
        kinds: which, of tracks (on the mat), words (who held which when) and air (what became of frames).
        name_of_word: what a word is called in the legend.
        progress: called with the simulated time in ms that has been read.

    Raises:
        RecordingError: the recording holds no moment, or the picture can't be written.
    """
    path = Path(path)
    check_writable(path, PICTURES)
    panels = [KINDS_OF_PLOT[kind](recording.about) for kind in kinds]
    read = 0
    for frame in recording.frames():
        for panel in panels:
            panel.take(frame)
        progress(frame.t_ms)
        read += 1
    if not read:
        raise RecordingError(f"{recording.name} holds no moment of the run: there is nothing to draw")
    figure = _figure(panels, name_of_word)
    try:
        figure.savefig(path, dpi=_DPI)
    except OSError as problem:
        raise RecordingError(f"{path} can't be written: {problem.strerror or problem}") from None


def _figure(panels: Sequence[Panel], name_of_word: Callable[[int], str]) -> Figure:
    """The panels on one figure: the first at the left and large, the others stacked beside it."""
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
