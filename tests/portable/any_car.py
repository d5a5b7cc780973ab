"""A car with parts of all kinds on a simulated microcontroller, beyond those of a car that somebody wires.

Portable: CPython and MicroPython run it with the same settings and must print the same lines (test_any_car.py).
"""

from driven_car import Bench


def lines(settings, platform):
    """Yield a line for each thing that the car does to its pins, and for what it senses."""
    bench = Bench(settings, platform)
    done = []
    bench.chip.listeners.append(lambda what, pin, value: done.append(f"{what} {pin} {value!r}"))
    board = bench.open().board
    yield f"leads {board.is_leader}"
    for direction in range(3):
        for level in range(4):
            board.set_wheels(direction, level)
    for which in range(5):
        board.set_led(which)
    for distance_mm in (None, 150, None):
        bench.sonar.distance_mm = distance_mm
        for step in range(80):
            bench.chip.levels[settings["inputs"]["floor"][step % 2]] = 800 * step
            done.append(f"senses {board.obstacle_mm()} {board.dark_floor()}")
            bench.clock.sleep_ms(5)
    board.close()
    yield from done
