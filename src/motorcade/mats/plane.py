"""Plane geometry that mats and the engine share: plain functions of numbers, which kernels are also made of.

They use only operations that IEEE 754 rounds exactly, so that the result is the same on every computer.
"""


def nearest_of_segment(x: float, y: float, x0: float, y0: float, x1: float, y1: float) -> tuple[float, float]:
    """The point of a segment nearest to (x, y)."""
    along_x = x1 - x0
    along_y = y1 - y0
    squared = along_x * along_x + along_y * along_y
    if squared == 0.0:
        return x0, y0
    part = ((x - x0) * along_x + (y - y0) * along_y) / squared
    part = min(max(part, 0.0), 1.0)
    return x0 + part * along_x, y0 + part * along_y


def is_left_of(x: float, y: float, x0: float, y0: float, x1: float, y1: float) -> bool:
    """Whether a ray to the right from (x, y) crosses a segment. A point inside a polygon crosses an odd number."""
    return (y0 > y) != (y1 > y) and x < x0 + (y - y0) / (y1 - y0) * (x1 - x0)
