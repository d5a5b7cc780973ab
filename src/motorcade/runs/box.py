"""The part of the plane that a run happens in."""

from collections.abc import Iterable

from motorcade.engine.moment import Moment
from motorcade.runs.description import Description
from motorcade.runs.recording import Recording

Box = tuple[float, float, float, float]


def box_of(about: Description, frames: Iterable[Moment]) -> Box:
    """The smallest box, in metres, that holds the mat and the cars of all ``frames``: left, bottom, right, top."""
    points = [(0.0, 0.0), about.size_m] if about.size_m else []
    for x, y, radius_m in about.discs:
        points += [(x - radius_m, y - radius_m), (x + radius_m, y + radius_m)]
    points += [corner for corners in about.polygons for corner in corners]
    points += [(x, y) for x0, y0, x1, y1 in about.walls for x, y in ((x0, y0), (x1, y1))]
    points += [(x, y) for path, _ in about.people for _, x, y in path]
    radius_m = about.diameter_m / 2
    for frame in frames:
        points.append((float(frame.x_m.min()) - radius_m, float(frame.y_m.min()) - radius_m))
        points.append((float(frame.x_m.max()) + radius_m, float(frame.y_m.max()) + radius_m))
    xs, ys = zip(*(points or [(0.0, 0.0), (1.0, 1.0)]), strict=True)
    return min(xs), min(ys), max(xs), max(ys)


def whole_box(recording: Recording) -> Box:
    """What shows all of a run: the mat and, unless its walls hold the cars, wherever one ever is."""
    about = recording.about
    held = about.size_m is not None and about.walled
    return box_of(about, [] if held else recording.frames())
