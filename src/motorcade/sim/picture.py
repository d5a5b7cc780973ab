"""A picture of where cars drove."""

import math
from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from motorcade.sim.world import Pose, World


def draw_tracks(tracks: Sequence[Sequence[tuple[float, float]]], world: World, path: Path) -> None:
    """Write the cars' tracks (metres) and where they ended to ``path``; its ending says the format."""
    figure = Figure(figsize=(8, 6), layout="constrained")
    axes = figure.add_subplot()
    radius_m = world.profile.body.diameter_mm / 2000
    for index in reversed(range(len(tracks))):
        leads = index == 0
        colour = "#d62728" if leads else f"C{(index - 1) % 9 if (index - 1) % 9 != 3 else 9}"
        xs, ys = zip(*tracks[index], strict=True)
        axes.plot(xs, ys, color=colour, linewidth=2.2 if leads else 1.2, alpha=0.9)
        axes.plot(xs[0], ys[0], marker="x", color=colour, markersize=6)
        _draw_car(axes, world.poses[index], radius_m, colour, leads)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.08)
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    cars = len(tracks)
    axes.set_title(f"One leader (red), {cars - 1} followers, {world.now_ms / 1000:g} s; x marks where each began")
    axes.grid(alpha=0.3)
    figure.savefig(path, dpi=120)


def _draw_car(axes: Axes, pose: Pose, radius_m: float, colour: str, leads: bool) -> None:
    axes.add_patch(Circle((pose.x, pose.y), radius_m, facecolor=colour, edgecolor="black", alpha=1 if leads else 0.7))
    nose_x = pose.x + radius_m * math.cos(pose.heading)
    nose_y = pose.y + radius_m * math.sin(pose.heading)
    axes.plot([pose.x, nose_x], [pose.y, nose_y], color="black", linewidth=1.5)
