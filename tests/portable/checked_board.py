"""Run check_board on a simulated microcontroller, whole and broken. Portable; for test_microcontroller.py."""

from driven_car import Bench
from simulated.flash import Flash
from simulated.observer import ChipObserver

from motorcade.car.check import check_board


def lines(settings, platform):
    """Yield what check_board finds for each of BROKEN; the first is the whole board, which has no fault."""
    for name, broken in BROKEN:
        bench = Bench(settings, platform, Flash(False))
        board = bench.open().board
        if name:
            setattr(board, name, broken)
        for breach in check(bench, board):
            yield f"{name}: {breach.brief()}"


def check(bench, board):
    """Return what check_board finds in a board that is observed."""

    def reopen():
        return bench.open().board

    sleep_ms, hear = bench.clock.sleep_ms, None if board.is_leader else bench.hear_frame
    return check_board(board, reopen, sleep_ms, hear, bench.usb.arrive, ChipObserver(bench))


def fail(*arguments):
    raise ValueError("broken")


def do_nothing(*arguments):
    pass


BROKEN = (
    ("", None),
    ("levels", (1, 2, 3)),
    ("received_frames", lambda: [1]),
    ("set_wheels", fail),
    ("set_led", do_nothing),
)
