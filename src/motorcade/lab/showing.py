"""Pictures of the worlds of an environment, and the window that shows them."""

from typing import Any

import numpy as np
from matplotlib import pyplot
from numpy.typing import NDArray

from motorcade.errors import InputError, MotorcadeError
from motorcade.lab.stepping import SteppedWorlds
from motorcade.runs.drawing import Box, bounding_box
from motorcade.runs.plots import MomentPictures
from motorcade.runs.recording import Description

Pixels = NDArray[np.uint8]
# How much more is shown than needed, so that a car that drives on changes the view seldom.
_MORE = 0.25
_DPI = 100


class WorldView:
    """Draws what worlds show now, in pictures of one size. What they show grows where a car leaves it."""

    def __init__(self, stepped: SteppedWorlds) -> None:
        self._stepped = stepped
        self._drawn: MomentPictures | None = None
        self._box: Box = (0.0, 0.0, 0.0, 0.0)
        self._images: tuple[bytes, ...] = ()

    def __reduce__(self) -> tuple[Any, ...]:
        # A copy draws the mat anew: Matplotlib's figures are large.
        return WorldView, (self._stepped,)

    def pictures(self, render_mode: str | None) -> list[Pixels]:
        """Return a picture of each world. Raises MotorcadeError: there is no mode, or no episode has begun."""
        if render_mode is None:
            raise InputError("no-render-mode")
        if not self._stepped.has_begun:
            raise MotorcadeError("episode-has-not-begun")
        world = self._stepped.world
        moments = [world.snapshot(number).in_single_precision() for number in range(world.worlds)]
        about = Description.of(world, self._stepped.step_ms)
        drawn = self._drawn
        box = bounding_box(about, moments)
        is_outside = box[0] < self._box[0] or box[1] < self._box[1] or box[2] > self._box[2] or box[3] > self._box[3]
        if drawn is None or is_outside or world.images != self._images:
            is_whole = drawn is None and about.mat.size_m is not None
            if not is_whole:
                left, bottom, right, top = box
                more_m = max(right - left, top - bottom) * _MORE
                box = (left - more_m, bottom - more_m, right + more_m, top + more_m)
            self._box = box
            self._images = world.images
            size = None
            if drawn:
                size = drawn.size
            drawn = self._drawn = MomentPictures(about, self._box, size)
        return [drawn.draw(moment) for moment in moments]


class Window:
    """A window of Matplotlib's that shows one picture after the other. It opens with the first."""

    def __init__(self) -> None:
        self._figure: Any = None
        self._picture: Any = None

    def __reduce__(self) -> tuple[Any, ...]:
        # A copy opens a window of its own.
        return Window, ()

    def show(self, picture: Pixels) -> None:
        """Show a picture. Raises MotorcadeError: no window can be opened here."""
        if self._figure is None or not pyplot.fignum_exists(self._figure.number):
            self._open(picture)
        self._picture.set_data(picture)
        self._figure.canvas.draw()
        self._figure.canvas.flush_events()

    def close(self) -> None:
        """Close the window, if it is open."""
        if self._figure is not None:
            pyplot.close(self._figure)
            self._figure = None

    def _open(self, picture: Pixels) -> None:
        height, width, _ = picture.shape
        try:
            figure = pyplot.figure(figsize=(width / _DPI, height / _DPI), dpi=_DPI)
        except ImportError as problem:
            raise MotorcadeError("no-window", reason=str(problem)) from None
        if figure.canvas.required_interactive_framework is None:
            pyplot.close(figure)
            raise MotorcadeError("no-window", reason=pyplot.get_backend())
        self._figure = figure
        self._picture = figure.figimage(picture)
        if figure.canvas.manager is not None:
            figure.canvas.manager.set_window_title("Motorcade")
        figure.show()
