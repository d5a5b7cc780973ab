"""A board's infrared: frames that are sent, and frames that are heard.

Portable.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable
    from typing import Any

from motorcade.car.board import Board
from motorcade.car.brain import frame_ms
from motorcade.car.check.probe import LONGEST_CALL_MS, BoardFailedError, Probe, is_count
from motorcade.words.infrared import to_frame
from motorcade.words.ticks import elapsed_ms

FRAME = to_frame(0xA4A80000)
_FRAMES = "a list or tuple of frames, ints of 32 bits"
_TRIES = 3
_STEP_MS = 2
_SLACK_MS = 10
_WITHIN_MS = 500


def check_sending(probe: Probe) -> None:
    """Note what is wrong with send_frame and is_sending, and with received_frames while nothing comes.

    A board that has no infrared doesn't override send_frame; there is nothing to check then.
    """
    try:
        _take_frames(probe)
        if _has_sender(probe.board):
            for _ in range(_TRIES):
                if _sends_right(probe):
                    break
            _check_echo(probe)
    except BoardFailedError:
        pass


def check_hearing(probe: Probe, hear: "Callable[[int], Any]") -> None:
    """Note frames that are lost, told twice, or dropped for their parity, which isn't the board's to do."""
    for frame, what in ((FRAME, "the frame"), (FRAME ^ 1, "the frame of odd parity, which the brain counts,")):
        heard: list[int] = []
        if probe.blames("received_frames"):
            return
        try:
            _take_frames(probe)
            hear(frame)
            for _ in range(_WITHIN_MS // _STEP_MS):
                heard += _take_frames(probe)
                probe.wait(_STEP_MS)
        except BoardFailedError:
            return
        if heard != [frame]:
            told = ", ".join([f"0x{each:08X}" for each in heard[:_TRIES]]) or "none"
            probe.breach(f"received_frames() gave {told} in all where {what} 0x{frame:08X} was sent once")


def _take_frames(probe: Probe) -> "list[int]":
    frames = probe.answer("received_frames", _are_frames, _FRAMES) or ()
    again = (probe.answer("received_frames", _are_frames, _FRAMES) or ()) if frames else ()
    if frames and list(frames) == list(again):
        probe.breach("received_frames() gave the same frames twice; each frame is told once: empty the list")
    return list(frames)


def _are_frames(value: object) -> bool:
    if not isinstance(value, (list, tuple)):
        return False
    return all(is_count(frame, 0xFFFFFFFF) for frame in value)


def _has_sender(board: object) -> bool:
    return getattr(type(board), "send_frame", None) is not Board.send_frame


def _sends_right(probe: Probe) -> bool:
    """Send a frame and watch it; True where that could be judged, for a busy computer may look away too long."""
    air_ms = frame_ms(FRAME, probe.board.levels)
    for _ in range(_WITHIN_MS // _STEP_MS):
        if not probe.call("is_sending"):
            break
        probe.wait(_STEP_MS)
    begin_ms = probe.call("now_ms")
    probe.call("send_frame", FRAME)
    returned_ms = elapsed_ms(probe.call("now_ms"), begin_ms)
    sends = probe.call("is_sending")
    looked_ms = elapsed_ms(probe.call("now_ms"), begin_ms)
    if not sends:
        if returned_ms > LONGEST_CALL_MS:
            probe.breach(f"send_frame took {returned_ms} ms; it begins a frame and comes back at once")
            return True
        if looked_ms < air_ms:
            probe.breach("is_sending() is False right after send_frame; it is True while the frame is on the air")
            return True
        return False
    last_ms = looked_ms
    while probe.call("is_sending") and last_ms < air_ms + _WITHIN_MS:
        probe.wait(_STEP_MS)
        last_ms = elapsed_ms(probe.call("now_ms"), begin_ms)
    if last_ms < air_ms - _SLACK_MS:
        probe.breach(f"is_sending() is False after {last_ms} ms of a frame that is on the air for {air_ms} ms")
    if last_ms >= air_ms + _WITHIN_MS:
        probe.breach(f"is_sending() is still True {last_ms} ms after send_frame; a frame takes {air_ms} ms")
    return True


def _check_echo(probe: Probe) -> None:
    probe.wait(_SLACK_MS)
    if FRAME in _take_frames(probe):
        probe.breach("received_frames() gave the frame that the board sent itself; a car can't hear while it sends")
