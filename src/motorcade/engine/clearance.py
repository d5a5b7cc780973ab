"""Until when nothing can come near enough to a car to matter: other cars, and what stands still.

Both are ticks, 15 bits of each, in one number. A sixteenth bit says that one holds however the car is pushed and
steered; without it, it holds as long as the car goes on as its wheels do now.
"""

from motorcade.engine.native import in_kernel

MOST_TICKS = 1000
_HALF = 0xFFFF
_ANYHOW = 0x00010001
_PAST = 0x4000


@in_kernel
def half(tick: int, anyhow: int) -> int:
    """A tick, and whether (1 or 0) it holds anyhow."""
    return (tick << 1 | anyhow) & _HALF


@in_kernel
def due_now(tick: int) -> int:
    """Both may be near at ``tick``."""
    return half(tick, 0) << 16 | half(tick, 0)


@in_kernel
def with_others(clear: int, others: int) -> int:
    """The same, with another half for the other cars."""
    return others << 16 | int(clear) & _HALF


@in_kernel
def with_place(clear: int, place: int) -> int:
    """The same, with another half for what stands still."""
    return int(clear) >> 16 << 16 | place


@in_kernel
def on_another_way(clear: int, tick: int) -> int:
    """What is left of it where the car leaves its way in the tick before ``tick``."""
    kept = (int(clear) & _ANYHOW) * _HALF
    return int(clear) & kept | due_now(tick) & ~kept & 0xFFFFFFFF


@in_kernel
def others_due(clear: int, tick: int) -> bool:
    """Whether another car may be near by now."""
    return (tick - (int(clear) >> 17)) & _PAST == 0


@in_kernel
def place_due(clear: int, tick: int) -> bool:
    """Whether a wall or an obstacle may be."""
    return (tick - (int(clear) >> 1)) & _PAST == 0


@in_kernel
def is_due(clear: int, tick: int) -> bool:
    """Whether anything may be."""
    return (tick - (int(clear) >> 17)) & (tick - (int(clear) >> 1)) & _PAST == 0


@in_kernel
def whole_ticks(ticks: float) -> int:
    """How many ticks a car may be left alone that has time for so many, one at least."""
    return int(min(max(ticks, 1.0), float(MOST_TICKS)))
