"""Run check_board on a simulated microcontroller, whole and broken. Portable; for test_microcontroller.py."""

from driven_car import Bench

from motorcade.car.check import check_board


def lines(settings, platform):
    """Yield what check_board finds for each of BROKEN; the first is the whole board, which has no fault."""
    for name, broken in BROKEN:
        bench = Bench(settings, platform)
        board = bench.open().board
        if name:
            setattr(board, name, broken)
        for breach in check_board(board, wait_ms=bench.clock.sleep_ms, hear=bench.hear_frame, say=bench.usb.arrive):
            yield f"{name}: {breach.brief()}"


def fail(*arguments):
    raise ValueError("broken")


BROKEN = (
    ("", None),
    ("levels", (1, 2, 3)),
    ("now_ms", lambda: 1 << 30),
    ("load_image", lambda: b"\x00\x00"),
    ("received_frames", lambda: [1]),
    ("is_sending", lambda: False),
    ("obstacle_mm", lambda: None),
    ("set_wheels", fail),
)
