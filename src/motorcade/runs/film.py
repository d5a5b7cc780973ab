"""Draw films of a run as GIF, by Pillow."""

from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from motorcade.engine.state import Moment
from motorcade.errors import MotorcadeError
from motorcade.runs.drawing import PLAIN, Box, Cars, draw_mat, picture_text, recording_box, show_box
from motorcade.runs.palette import WordColours
from motorcade.runs.recording import FILM_ENDING, Description, Progress, Recording, check_writable

# Wide, square and tall.
SIZES = ((640, 400), (512, 512), (400, 640))
MOST_IMAGES_S = 10
# Pillow keeps all images of a GIF in memory until the last.
MOST_GIF_IMAGES = 2000
_DPI = 100

Image = NDArray[np.uint8]


def draw_film(
    recording: Recording, path: str | Path, speed: float = 1.0, progress: Progress = lambda done_ms: None
) -> None:
    """Draw a run as a film, a .gif file.

    Every recorded moment becomes an image. Where that would be more than 10 images a second, only every second moment
    does, or every third, and so on.

    Args:
        path: the file; an old one stays until the new one is complete.
        speed: simulated seconds in a second of the film, above 0.
        progress: called with the simulated time in ms that has been drawn.

    Raises:
        MotorcadeError: the recording holds no moment, a GIF would be too long, or the film can't be written.
    """
    path = Path(path)
    check_writable(path, [FILM_ENDING])
    moments_s = speed * 1000 / recording.about.every_ms
    step = max(1, int(np.ceil(moments_s / MOST_IMAGES_S - 1e-9)))
    box = recording_box(recording)
    pictures = _Pictures(recording.about, box, *_size(box))
    images = _images(recording, pictures, step, progress)
    first = next(images, None)
    if first is None:
        raise MotorcadeError("nothing-recorded", file=recording.name)
    unfinished = path.with_name(f".{path.stem}.unfinished{FILM_ENDING}")
    try:
        _write_gif(chain([first], images), unfinished, moments_s / step, pictures.palette())
        unfinished.replace(path)
    except (OSError, ValueError) as problem:
        reason = str(problem).splitlines()[0] if str(problem) else type(problem).__name__
        raise MotorcadeError("film-not-drawn", file=path, reason=reason) from None
    finally:
        unfinished.unlink(missing_ok=True)


def _images(recording: Recording, pictures: "_Pictures", step: int, progress: Progress) -> Iterator[Image]:
    for number, moment in enumerate(recording.moments()):
        if number % step == 0:
            yield pictures.draw(moment)
            progress(moment.t_ms)


def _size(box: Box) -> tuple[int, int]:
    left, bottom, right, top = box
    wide, square, tall = SIZES
    if right - left > 1.3 * (top - bottom):
        return wide
    return tall if top - bottom > 1.3 * (right - left) else square


class _Pictures:
    """Draw moments as RGB images; the mat is drawn only once."""

    def __init__(self, about: Description, box: Box, width: int, height: int):
        figure = Figure(figsize=(width / _DPI, height / _DPI), dpi=_DPI, layout="constrained")
        self._canvas = FigureCanvasAgg(figure)
        self._axes = figure.add_subplot()
        draw_mat(self._axes, about)
        show_box(self._axes, box)
        self._axes.set_title(" ")
        self._canvas.draw()
        # The layout must not change any more.
        figure.set_layout_engine("none")
        self._still = self._canvas.copy_from_bbox(figure.bbox)
        self._title = self._axes.annotate(
            "", (0.5, 1), xycoords="axes fraction", xytext=(0, 5), textcoords="offset points", ha="center", size=11
        )
        self._cars = Cars(self._axes, about)
        self._colours = WordColours(about.images)
        self._mat = about.mat

    def palette(self) -> Image:
        """At most 256 colours, a row each: those that are drawn, and their mixtures with their surroundings."""
        strong = np.unique(np.concatenate([self._colours.shades.reshape(-1, 3), PLAIN]), axis=0)[:48]
        edges = [strong + (onto - strong) * share for onto in (0.12, 1.0) for share in (0.4, 0.75)]
        greys = np.linspace(0, 1, 12)[:, None].repeat(3, axis=1)
        return (np.concatenate([strong, *edges, greys]) * 255).round().astype(np.uint8)

    def draw(self, moment: Moment) -> Image:
        self._cars.show(moment, self._colours.of(moment.word, moment.runs))
        cars = len(moment.x_m)
        key = "picture-film-of-one" if cars == 1 else "picture-film"
        self._title.set_text(picture_text(key, mat=self._mat, cars=cars, t_s=moment.t_ms / 1000))
        self._canvas.restore_region(self._still)
        for artist in (*self._cars.artists, self._title):
            self._axes.draw_artist(artist)
        return np.ascontiguousarray(np.asarray(self._canvas.buffer_rgba())[:, :, :3])


def _write_gif(images: Iterator[Image], path: Path, images_s: float, palette: Image) -> None:
    from PIL import Image as Pillow

    coloured = Pillow.new("P", (1, 1))
    coloured.putpalette(palette.tobytes())

    def reduced() -> Iterator[Pillow.Image]:
        for number, image in enumerate(images):
            if number == MOST_GIF_IMAGES:
                raise MotorcadeError("gif-too-long", most=MOST_GIF_IMAGES)
            yield Pillow.fromarray(image).quantize(palette=coloured, dither=Pillow.Dither.NONE)

    rest = reduced()
    duration_ms = max(20, round(1000 / images_s))
    next(rest).save(path, save_all=True, append_images=rest, duration=duration_ms, loop=0)
