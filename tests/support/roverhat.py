"""The library of the imaginary motor board in docs/write-a-board.md; after a while somebody presses Ctrl-C."""

import sys
import time

from motorcade.words.infrared import air_us

# The code on the page imports it by its own name.
sys.modules["roverhat"] = sys.modules[__name__]
TICKS = 20
done: list[tuple[int, ...]] = []
# What stands before the car, or None; and whether its motors are at the wrong terminals.
obstacle_cm: list[float | None] = [None]
wheels_swapped = [False]
_left = [0]
_sent_until_s = [0.0]
_sent: list[int] = []


def switch_on(ticks: int = TICKS) -> None:
    """Let the serial line be read so often; the next time somebody presses Ctrl-C."""
    done.clear()
    _left[0] = ticks


def serial_read() -> bytes:
    _left[0] -= 1
    if _left[0] < 0:
        raise KeyboardInterrupt
    return b""


def serial_write(data: bytes) -> None:
    pass


def infrared_frames() -> list[int]:
    return []


def infrared_busy() -> bool:
    return time.monotonic() < _sent_until_s[0]


def infrared_send(frame: int) -> None:
    _sent.append(frame)
    _sent_until_s[0] = time.monotonic() + air_us(frame, 560) / 1e6


def distance_cm() -> float | None:
    return obstacle_cm[0]


def motors(left: int, right: int) -> None:
    done.append((left, right))


def led(which: int, on: bool) -> None:
    done.append((which, on))


def encoder_counts() -> tuple[int, int]:
    left, right = next((each for each in reversed(done) if not isinstance(each[1], bool)), (0, 0))
    return (right, left) if wheels_swapped[0] else (left, right)


def second_receiver_frames() -> list[int]:
    sent = list(_sent)
    _sent.clear()
    return sent
