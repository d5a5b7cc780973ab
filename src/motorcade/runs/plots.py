"""Draw a run: the cars' tracks and last positions as a picture, or all of it as a film (GIF, by Pillow)."""

import io
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from motorcade.config.files import raised_as, replace_file
from motorcade.engine.moment import Moment
from motorcade.engine.pictures import LEDS
from motorcade.errors import InputError
from motorcade.runs.drawing import PLAIN, Box, CarArtists, bounding_box, draw_mat, picture_text, show_box
from motorcade.runs.recording import (
    FOLLOWERS,
    LEADER,
    Description,
    OnProgress,
    Recording,
    WordColours,
    rgb,
    shown_moments,
    writing,
)

# Wide, square and tall.
SIZES = ((640, 400), (512, 512), (400, 640))
MOST_IMAGES_S = 10
# Pillow keeps all images of a GIF in memory until the last.
MOST_GIF_IMAGES = 2000
_FILM_DPI = 100

Pixels = NDArray[np.uint8]
_DPI = 120
_MOST_TRACKS = 1000
_MOST_POINTS = 1_000_000
_FEW_TRACKS = 30


def draw_tracks(recording: Recording, path: Path, progress: OnProgress = lambda done_ms: None) -> None:
    """Write a picture of the tracks of a run to ``path``, in the format of its ending.

    Args:
        path: a PNG, SVG or PDF file.
        progress: called with the simulated time in ms that has been read.

    Raises:
        MotorcadeError: the recording holds no moment, or the picture can't be written.
    """
    about = recording.about
    last = None
    leads = about.is_leader()
    followers = np.flatnonzero(~leads)
    step = max(1, len(followers) // _MOST_TRACKS)
    drawn = np.concatenate([followers[::step], np.flatnonzero(leads)[:_MOST_TRACKS]])
    most = max(50, _MOST_POINTS // max(1, len(drawn)))
    every = recording.last_ms // about.every_ms // most + 1
    points = []
    for number, moment in enumerate(shown_moments(recording)):
        if last and moment.run != last.run:
            # A line ends at such a point.
            points.append(np.full_like(points[0], np.nan))
        last = moment
        if number % every == 0:
            points.append(np.column_stack([last.x_m[drawn], last.y_m[drawn]]))
        progress(last.t_ms)
    if last is None:
        raise InputError("nothing-recorded", file=recording.name)
    points.append(np.column_stack([last.x_m[drawn], last.y_m[drawn]]))
    figure = Figure(figsize=(8, 6), layout="constrained")
    _draw_tracks(figure, about, drawn, np.stack(points, axis=1), last)
    with writing(path):
        figure.savefig(path, dpi=_DPI)


def _draw_tracks(
    figure: Figure, about: Description, drawn: NDArray[np.intp], tracks: NDArray[np.float32], last: Moment
) -> None:
    """Draw the mat, the ``tracks`` (cars, moments, 2) of the cars ``drawn``, and all cars at the ``last`` moment."""
    axes = figure.add_subplot()
    draw_mat(axes, about)
    axes.update_datalim(tracks.reshape(-1, 2))
    show_box(axes, bounding_box(about, [last]))
    few = len(drawn) <= _FEW_TRACKS
    leads = about.is_leader()
    # A different colour for each follower where there are few; red for leaders.
    cycle = np.array(list(map(rgb, FOLLOWERS)), np.float32)
    if not few:
        cycle = cycle[:1]
    colours: NDArray[np.float32] = cycle[(np.cumsum(~leads) - 1) % len(cycle)]
    colours[leads] = rgb(LEADER)
    for leading, wide, thin, faint in ((False, 1.2, 0.6, 0.35), (True, 2.2, 1.2, 0.9)):
        which = leads[drawn] == leading
        style = {"linewidths": wide, "alpha": 0.9} if few else {"linewidths": thin, "alpha": faint}
        axes.add_collection(LineCollection(list(tracks[which]), colors=colours[drawn[which]], **style))
    if few:
        xs, ys = tracks[:, 0].T
        axes.scatter(xs, ys, c=colours[drawn], marker="x", s=36, zorder=2.5)
    figure.draw_without_rendering()
    CarArtists(axes, about).show(last._replace(led=np.full_like(last.led, len(LEDS))), colours)
    axes.set_title(_title(about, last.t_ms / 1000, len(drawn)))


def _title(about: Description, t_s: float, drawn: int) -> str:
    leaders = len(about.leaders)
    followers = about.cars - leaders
    leading = picture_text("picture-leaders", count=leaders)
    if leaders == 1:
        leading = picture_text("picture-one-leader")
    following = picture_text("picture-followers", count=followers)
    if followers == 1:
        following = picture_text("picture-one-follower")
    title = picture_text("picture-tracks", leaders=leading, followers=following, t_s=t_s)
    if drawn <= _FEW_TRACKS:
        return picture_text("picture-tracks-few", title=title)
    if drawn == about.cars:
        return title
    return picture_text("picture-tracks-some", title=title, count=drawn)


def draw_film(
    recording: Recording, path: Path, speed: float = 1.0, progress: OnProgress = lambda done_ms: None
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
    moments_s = speed * 1000 / recording.about.every_ms
    step = max(1, int(np.ceil(moments_s / MOST_IMAGES_S - 1e-9)))
    moments: Iterable[Moment] = ()
    # Where the mat's edge is a wall, no car is outside.
    if not recording.about.mat.walled:
        moments = shown_moments(recording)
    box = bounding_box(recording.about, moments)
    pictures = MomentPictures(recording.about, box)
    images = _images(recording, pictures, step, progress)
    first = next(images, None)
    if first is None:
        raise InputError("nothing-recorded", file=recording.name)
    with raised_as("film-not-drawn", (OSError, ValueError), file=path):
        replace_file(path, _gif_of(chain([first], images), moments_s / step, pictures.palette()))


def _images(recording: Recording, pictures: "MomentPictures", step: int, progress: OnProgress) -> Iterator[Pixels]:
    for number, moment in enumerate(shown_moments(recording)):
        if number % step == 0:
            yield pictures.draw(moment)
            progress(moment.t_ms)


def _size(box: Box) -> tuple[int, int]:
    left, bottom, right, top = box
    wide, square, tall = SIZES
    if right - left > 1.3 * (top - bottom):
        return wide
    if top - bottom > 1.3 * (right - left):
        return tall
    return square


class MomentPictures:
    """Draw moments as RGB images; the mat is drawn only once.

    Args:
        about: the run.
        box: what the images show at least.
        size: their width and height in pixels; None: one of SIZES, which suits the box.
    """

    def __init__(self, about: Description, box: Box, size: tuple[int, int] | None = None):
        self.size = size or _size(box)
        width, height = self.size
        figure = Figure(figsize=(width / _FILM_DPI, height / _FILM_DPI), dpi=_FILM_DPI, layout="constrained")
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
        self._cars = CarArtists(self._axes, about)
        self._colours = WordColours(about.images)
        self._mat = about.mat.name

    def palette(self) -> Pixels:
        """At most 256 colours, a row each: those that are drawn, and their mixtures with their surroundings."""
        strong = np.unique(np.concatenate([self._colours.shades.reshape(-1, 3), PLAIN]), axis=0)[:48]
        edges = [strong + (onto - strong) * share for onto in (0.12, 1.0) for share in (0.4, 0.75)]
        greys = np.linspace(0, 1, 12)[:, None].repeat(3, axis=1)
        return (np.concatenate([strong, *edges, greys]) * 255).round().astype(np.uint8)

    def draw(self, moment: Moment) -> Pixels:
        self._cars.show(moment, self._colours.of(moment.word, moment.runs))
        cars = len(moment.x_m)
        self._title.set_text(picture_text("picture-film", mat=self._mat, cars=cars, t_s=moment.t_ms / 1000))
        self._canvas.restore_region(self._still)
        for artist in (*self._cars.artists, self._title):
            self._axes.draw_artist(artist)
        return np.ascontiguousarray(np.asarray(self._canvas.buffer_rgba())[:, :, :3])


def _gif_of(images: Iterator[Pixels], images_s: float, palette: Pixels) -> bytes:
    from PIL import Image as Pillow

    coloured = Pillow.new("P", (1, 1))
    coloured.putpalette(palette.tobytes())

    def reduced() -> Iterator[Pillow.Image]:
        for number, image in enumerate(images):
            if number == MOST_GIF_IMAGES:
                raise InputError("gif-too-long", most=MOST_GIF_IMAGES)
            yield Pillow.fromarray(image).quantize(palette=coloured, dither=Pillow.Dither.NONE)

    rest = reduced()
    drawn = io.BytesIO()
    duration_ms = max(20, round(1000 / images_s))
    next(rest).save(drawn, "GIF", save_all=True, append_images=rest, duration=duration_ms, loop=0)
    return drawn.getvalue()
