"""Draw the picture of a camera on the front of a simulated car: floor, walls, obstacles, cars with LEDs, people.

It is a pinhole camera that looks along the car's heading, computed with NumPy. The floor is computed for each pixel.
Walls and obstacles are upright and equally high, so in each column the nearest hides all others. Cars and people look
the same from every side: they are billboards, drawn from the farthest to the nearest where nothing hides them.
"""

import io
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from motorcade.engine.layout import people_at
from motorcade.engine.moment import Moment
from motorcade.engine.native import InterpretedKernels
from motorcade.engine.pictures import LEDS
from motorcade.engine.simulation import Simulation
from motorcade.mats.model import Mat, path_of

Colours = NDArray[np.float32]
RGB = tuple[int, int, int]
Floats = NDArray[np.float64]

WIDTH = 320
HEIGHT = 240
_HALF_VIEW_DEG = 35
_CAMERA_M = 0.09
_WALL_M = 0.3
_CAR_M = 0.1
_LED_M = 0.02
_PERSON_M = (0.17, 1.5)
_TILE_M = 0.25
# Beyond this distance everything has the colour of haze.
_HAZE_M = 8.0
_NEAR_M = 0.02
_MOST_BILLBOARDS = 200
_QUALITY = 70

_SKY = (150, 190, 225)
_HAZE = (205, 215, 222)
_FLOOR = (228, 222, 208)
_LINE = (180, 170, 150)
_OUTSIDE = (190, 186, 176)
_DARK = (30, 31, 36)
# Dark marks on the floor are drawn once, from above: so fine where they are no larger than the picture may be.
_FINE_M = 0.005
_MOST_CELLS = 4000
_WALL = (200, 120, 80)
_OBSTACLE = (120, 130, 145)
_LEADER = (36, 87, 197)
_FOLLOWER = (176, 42, 91)
_PERSON = (80, 110, 80)
_LAMP = (255, 250, 220)
_TAIL = (220, 30, 30)
_LED_COLOURS: list[RGB] = [(int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)) for colour in LEDS]


class _Billboard(NamedTuple):
    """A flat upright picture: its distance ahead and to the left, half its width, its lower and upper end; metres."""

    ahead: float
    aside: float
    half_m: float
    low_m: float
    high_m: float
    colour: RGB


class _DarkFloor(NamedTuple):
    """What is dark on the floor, from above: the lower left corner, the cells in a metre, and the cells' darkness."""

    left_m: float
    low_m: float
    per_m: float
    cells: NDArray[np.bool_]

    def at(self, x: Floats, y: Floats) -> NDArray[np.bool_]:
        """Return whether the floor is dark at each of these points."""
        column = np.floor((x - self.left_m) * self.per_m).astype(int)
        row = np.floor((y - self.low_m) * self.per_m).astype(int)
        rows, columns = self.cells.shape
        inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
        dark: NDArray[np.bool_] = inside & self.cells[np.where(inside, row, 0), np.where(inside, column, 0)]
        return dark


def _dark_floor(mat: Mat) -> _DarkFloor | None:
    """Draw the lines, spots and patches of a mat from above; None where there are none."""
    bands = [(path_of(line), line.width_m) for line in mat.lines] + [
        ([(x, y)], 2 * radius) for x, y, radius in mat.spots
    ]
    areas = [*bands, *((list(corners), 0.0) for corners in mat.patches)]
    if not areas:
        return None
    low = [min(point[axis] - wide_m / 2 for points, wide_m in areas for point in points) for axis in (0, 1)]
    high = [max(point[axis] + wide_m / 2 for points, wide_m in areas for point in points) for axis in (0, 1)]
    size_m = max(high[0] - low[0], high[1] - low[1], _FINE_M)
    per_m = min(1 / _FINE_M, _MOST_CELLS / size_m)
    size = [math.ceil((high[axis] - low[axis]) * per_m) + 1 for axis in (0, 1)]
    image = Image.new("1", (size[0], size[1]))
    pen = ImageDraw.Draw(image)
    for points, wide_m in areas:
        cells = [((x - low[0]) * per_m, (y - low[1]) * per_m) for x, y in points]
        if not wide_m:
            pen.polygon(cells, fill=1)
            continue
        half = wide_m / 2 * per_m
        pen.line(cells, fill=1, width=max(1, round(2 * half)))
        for x, y in cells:
            pen.ellipse((x - half, y - half, x + half, y + half), fill=1)
    return _DarkFloor(low[0], low[1], per_m, np.array(image, bool))


class Scene:
    """Draws the pictures of the cameras of a world: of its cars as they are at any moment, on its mat as it is now."""

    def __init__(self, world: Simulation):
        mat = self._mat = world.mat
        self._radius_m = world.profile.body.diameter_mm / 2000
        self._leads = mat.starts.leads
        walls = [(*wall, 0) for wall in mat.walls]
        if mat.walled and mat.size_m:
            (w, h) = mat.size_m
            walls += [(0, 0, w, 0, 0), (w, 0, w, h, 0), (w, h, 0, h, 0), (0, h, 0, 0, 0)]
        for corners in mat.polygons:
            walls += [(*here, *there, 1) for here, there in zip(corners, corners[1:] + corners[:1], strict=True)]
        self._walls = np.array(walls, float).reshape(-1, 5)
        self._discs = np.array(mat.discs, float).reshape(-1, 3)
        self._dark = _dark_floor(mat)
        self._focus = WIDTH / 2 / math.tan(math.radians(_HALF_VIEW_DEG))
        self._horizon = HEIGHT * 0.42
        # For each column: how far left its ray is, one metre ahead. For each row: how far ahead it meets the floor.
        self._slopes = (WIDTH / 2 - 0.5 - np.arange(WIDTH)) / self._focus
        rows = np.arange(HEIGHT) + 0.5 - self._horizon
        self._floor_rows = np.flatnonzero(rows > 0.5)
        self._floor_m = self._focus * _CAMERA_M / rows[self._floor_rows]
        sky = np.clip((np.arange(HEIGHT) + 0.5) / self._horizon, 0, 1)[:, None]
        above = np.array(_SKY) * (1 - sky) + np.array(_HAZE) * sky
        self._background = np.repeat(above.astype(np.float32)[:, None, :], WIDTH, axis=1)

    def draw(self, now: Moment, car: int) -> NDArray[np.uint8]:
        """Draw the picture of a car's camera at a moment: (height, width, 3), red, green and blue."""
        heading = float(now.heading[car])
        cos = math.cos(heading)
        sin = math.sin(heading)
        x = float(now.x_m[car]) + self._radius_m * cos
        y = float(now.y_m[car]) + self._radius_m * sin
        picture = self._background.copy()
        self._draw_floor(picture, x, y, cos, sin)
        depths = self._draw_walls(picture, x, y, cos, sin)
        for billboard in self._billboards(now, car, x, y, cos, sin):
            self._draw_billboard(picture, depths, billboard)
        seen: NDArray[np.uint8] = np.clip(picture, 0, 255).astype(np.uint8)
        return seen

    def _draw_floor(self, picture: Colours, x: float, y: float, cos: float, sin: float) -> None:
        ahead = self._floor_m[:, None]
        aside = ahead * self._slopes
        floor_x = x + ahead * cos - aside * sin
        floor_y = y + ahead * sin + aside * cos
        # Far away a line is one pixel wide, and it fades where lines are too close together.
        wide = np.maximum(0.006, self._floor_m / self._focus * 1.2)[:, None]
        near_x, near_y = (np.abs((axis / _TILE_M + 0.5) % 1 - 0.5) * _TILE_M for axis in (floor_x, floor_y))
        lines = (np.minimum(near_x, near_y) < wide) * np.clip(1.5 - ahead / 4, 0, 1)
        ground = np.broadcast_to(np.array(_FLOOR, np.float32), (*lines.shape, 3))
        if self._mat.size_m:
            w, h = self._mat.size_m
            inside = (floor_x >= 0) & (floor_x <= w) & (floor_y >= 0) & (floor_y <= h)
            ground = np.where(inside[..., None], ground, np.array(_OUTSIDE, np.float32))
        shaded = ground + (np.array(_LINE, np.float32) - ground) * lines[..., None]
        if self._dark:
            shaded = np.where(self._dark.at(floor_x, floor_y)[..., None], np.array(_DARK, np.float32), shaded)
        picture[self._floor_rows] = _hazy(shaded, np.broadcast_to(ahead, lines.shape))

    def _draw_walls(self, picture: Colours, x: float, y: float, cos: float, sin: float) -> Floats:
        """Draw the nearest wall or obstacle of each column; return its distance ahead, inf where there is none."""
        seen = [self._seen_walls(x, y, cos, sin), self._seen_discs(x, y, cos, sin)]
        nowhere = np.full((1, WIDTH), np.inf)
        far = np.concatenate([nowhere, *(far_m for far_m, _ in seen)])
        shown = np.concatenate([np.zeros((1, WIDTH, 3)), *(colours for _, colours in seen)])
        nearest = far.argmin(axis=0), np.arange(WIDTH)
        depths: Floats = far[nearest]
        colours = shown[nearest].astype(np.float32)
        solid = np.flatnonzero(np.isfinite(depths))
        if len(solid):
            rows = np.arange(HEIGHT)[:, None] + 0.5 - self._horizon
            scale = self._focus / depths[solid]
            stands = (rows >= (_CAMERA_M - _WALL_M) * scale) & (rows <= _CAMERA_M * scale)
            picture[:, solid] = np.where(stands[..., None], _hazy(colours[solid], depths[solid]), picture[:, solid])
        return depths

    def _seen_walls(self, x: float, y: float, cos: float, sin: float) -> tuple[Floats, Floats]:
        """How far ahead each wall is in each column, inf where it isn't seen, and its colour there."""
        x0, y0, x1, y1, solid = self._walls.T[..., None]
        ahead_0 = (x0 - x) * cos + (y0 - y) * sin
        aside_0 = (y0 - y) * cos - (x0 - x) * sin
        ahead = (x1 - x0) * cos + (y1 - y0) * sin
        aside = (y1 - y0) * cos - (x1 - x0) * sin
        with np.errstate(divide="ignore", invalid="ignore"):
            part = (ahead_0 * self._slopes - aside_0) / (aside - ahead * self._slopes)
            far = ahead_0 + part * ahead
        hits = (part >= 0) & (part <= 1) & (far > _NEAR_M)
        light = 0.75 + 0.25 * np.abs(ahead) / np.hypot(ahead, aside)
        colours = np.where(solid, _OBSTACLE, _WALL) * light
        return np.where(hits, far, np.inf), np.broadcast_to(colours[:, None], (*far.shape, 3))

    def _seen_discs(self, x: float, y: float, cos: float, sin: float) -> tuple[Floats, Floats]:
        """How far ahead each round obstacle is in each column, inf where it isn't seen, and its colour there."""
        disc_x, disc_y, radius = self._discs.T[..., None]
        ahead = (disc_x - x) * cos + (disc_y - y) * sin
        aside = (disc_y - y) * cos - (disc_x - x) * sin
        a = 1 + self._slopes**2
        b = ahead + aside * self._slopes
        root = b * b - a * (ahead * ahead + aside * aside - radius * radius)
        far = (b - np.sqrt(np.maximum(root, 0))) / a
        off = np.clip((far * self._slopes - aside) / radius, -1, 1)
        hits = (root > 0) & (far > _NEAR_M)
        return np.where(hits, far, np.inf), np.array(_OBSTACLE) * (1 - 0.45 * np.abs(off))[..., None]

    def _billboards(self, now: Moment, car: int, x: float, y: float, cos: float, sin: float) -> list[_Billboard]:
        """The billboards of cars and people in view, the farthest first."""
        dx = now.x_m.astype(float) - x
        dy = now.y_m.astype(float) - y
        ahead = dx * cos + dy * sin
        aside = dy * cos - dx * sin
        wide = abs(self._slopes[0])
        in_view = (ahead > _NEAR_M) & (ahead < _HAZE_M) & (np.abs(aside) < ahead * wide + self._radius_m)
        in_view[car] = False
        near = np.flatnonzero(in_view)
        near = near[np.argsort(ahead[near])][:_MOST_BILLBOARDS]
        billboards = [
            billboard for k in near for billboard in self._car(now, int(k), float(ahead[k]), float(aside[k]), cos, sin)
        ]
        for person_x, person_y in people_at(self._mat, now.t_ms, InterpretedKernels()):
            to_x = person_x - x
            to_y = person_y - y
            half_m, high_m = _PERSON_M
            at = to_x * cos + to_y * sin, to_y * cos - to_x * sin
            billboards.append(_Billboard(*at, half_m, 0.0, high_m, _PERSON))
        seen = [billboard for billboard in billboards if billboard.ahead > _NEAR_M]
        return sorted(seen, key=lambda billboard: -billboard.ahead)

    def _car(self, now: Moment, k: int, ahead: float, aside: float, cos: float, sin: float) -> list[_Billboard]:
        """A car's body, its LED on top, and the visible of its lamps: white in front, red at the back."""
        radius = self._radius_m
        body = _Billboard(ahead, aside, radius, 0.01, _CAR_M, _LEADER if self._leads[k] else _FOLLOWER)
        billboards = [body]
        led = int(now.led[k])
        if led < len(_LED_COLOURS):
            billboards.append(_Billboard(ahead - 1e-4, aside, _LED_M, _CAR_M, _CAR_M + 2 * _LED_M, _LED_COLOURS[led]))
        look_x = math.cos(now.heading[k])
        look_y = math.sin(now.heading[k])
        along = look_x * cos + look_y * sin
        across = look_y * cos - look_x * sin
        for end, colour in ((1, _LAMP), (-1, _TAIL)):
            for side in (0.5, -0.5):
                # The lamp's place on the round body, seen from here; the body hides lamps on its far side.
                lamp_along = radius * (end * along * 0.87 - side * across)
                lamp_across = radius * (end * across * 0.87 + side * along)
                if lamp_along * ahead + lamp_across * aside < 0:
                    billboards.append(_Billboard(ahead - 1e-4, aside + lamp_across, radius * 0.12, 0.04, 0.06, colour))
        return billboards

    def _draw_billboard(self, picture: Colours, depths: Floats, billboard: _Billboard) -> None:
        scale = self._focus / billboard.ahead
        middle = WIDTH / 2 - billboard.aside * scale
        left, right = (round(middle + sign * billboard.half_m * scale) for sign in (-1, 1))
        top = max(round(self._horizon + (_CAMERA_M - billboard.high_m) * scale), 0)
        bottom = min(round(self._horizon + (_CAMERA_M - billboard.low_m) * scale), HEIGHT)
        columns = np.arange(max(left, 0), min(max(right, left + 1), WIDTH))
        columns = columns[depths[columns] > billboard.ahead]
        if not len(columns) or bottom <= top:
            return
        # Shading makes it look round.
        off = np.clip((columns + 0.5 - middle) / max(billboard.half_m * scale, 0.5), -1, 1)
        shades = np.array(billboard.colour, np.float32) * (1 - 0.45 * off**2)[:, None].astype(np.float32)
        picture[top:bottom, columns] = _hazy(shades, np.full(len(columns), billboard.ahead))


def _hazy(colours: Colours, far_m: Floats) -> Colours:
    """Mix the colours with haze, by distance."""
    share = (np.clip(far_m / _HAZE_M, 0, 1) ** 2)[..., None].astype(np.float32)
    return np.asarray(colours + (np.array(_HAZE, np.float32) - colours) * share, np.float32)


def to_jpeg(picture: NDArray[np.uint8]) -> bytes:
    """Encode a picture as a JPEG file."""
    file = io.BytesIO()
    Image.fromarray(picture).save(file, "JPEG", quality=_QUALITY)
    return file.getvalue()
