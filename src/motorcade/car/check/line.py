"""Check a board's serial line: every byte that comes is given once, and every byte that is written leaves.

Portable.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable
    from typing import Any

from motorcade.car.check.calls import FRAME, is_bytes
from motorcade.car.check.probe import LONGEST_CALL_MS, Probe, brief
from motorcade.errors import Phrase

# Neither an image nor an answer to an upload begins with these bytes.
_SENT = b"check\n"
_WITHIN_MS = 500
# The largest image at 115200 baud, which brings 11.5 bytes a ms, while ticks take as long as they do: some up to 20 ms.
_SAMPLE_BYTES = 2044
_TICKS = ((20, 230), (10, 115), (10, 115), (10, 115))
_BYTES_A_TICK = 230
_GIVES_UP_MS = 10000


def check_reading(probe: Probe, say: "Callable[[bytes], Any]", sends: bool = False) -> None:
    """Note bytes that come and are lost, changed or given twice; with ``sends`` while frames are sent."""
    if sends and not _can_send(probe):
        return

    def read() -> "Any":
        return probe.fitting("read_serial", probe.call("read_serial"), is_bytes, "bytes")

    _rest(probe, read)
    if not sends:
        say(_SENT)
        received = _rest(probe, read)
        probe.require(received == _SENT, "check-line", value=brief(received), sent=repr(_SENT))
    sample, received = _sample(), b""
    said = ticks = 0
    while said < len(sample):
        tick_ms, count = _TICKS[ticks % len(_TICKS)]
        say(sample[said : said + count])
        if sends:
            _send(probe)
        probe.wait(tick_ms)
        received += read()
        said += count
        ticks += 1
    _compare(probe, received + _rest(probe, read), sample, sends)


def check_writing(probe: Probe, written_bytes: "Callable[[], bytes]", sends: bool = False) -> None:
    """Note bytes that are written and don't leave as they are; with ``sends`` while frames are sent."""
    if probe.has_breach_of("bytes_a_tick") or (sends and not _can_send(probe)):
        return
    sample, at_once = _sample(), min(getattr(probe.board, "bytes_a_tick", _BYTES_A_TICK), _BYTES_A_TICK)
    written_bytes()
    written = b""
    for place in range(0, len(sample), at_once):
        probe.call("write_serial", sample[place : place + at_once])
        if sends:
            _send(probe)
        probe.wait(LONGEST_CALL_MS)
        written += written_bytes()
    _compare(probe, written + _rest(probe, written_bytes), sample, sends)


def _rest(probe: Probe, take: "Callable[[], bytes]") -> bytes:
    """Return what comes until nothing does for a while; a slow line brings bytes late."""
    taken = b""
    silent_ms = passed_ms = 0
    while silent_ms < _WITHIN_MS and passed_ms < _GIVES_UP_MS:
        probe.wait(LONGEST_CALL_MS)
        data = take()
        taken += data
        silent_ms = 0 if data else silent_ms + LONGEST_CALL_MS
        passed_ms += LONGEST_CALL_MS
    return taken


def _can_send(probe: Probe) -> bool:
    broken = any(probe.has_breach_of(name) for name in ("levels", "send_frame", "is_sending"))
    return probe.has_own("send_frame") and not broken


def _send(probe: Probe) -> None:
    if not probe.call("is_sending"):
        probe.call("send_frame", FRAME)


def _sample() -> bytes:
    """Return bytes of every value, also line ends, zeros and those that end a line in some terminals."""
    return bytes([(value * 7 + value // 256) & 0xFF for value in range(64, 64 + _SAMPLE_BYTES)])


def _compare(probe: Probe, received: bytes, sent: bytes, while_sending: bool) -> None:
    place = 0
    while place < min(len(received), len(sent)) and received[place] == sent[place]:
        place += 1
    details: dict[str, Any] = {"received": len(received), "sent": len(sent), "place": place}
    details["expected"] = f"0x{sent[place]:02X}" if place < len(sent) else Phrase("check-none")
    details["got"] = f"0x{received[place]:02X}" if place < len(received) else Phrase("check-none")
    key = "check-line-changes"
    if while_sending:
        key = "check-line-while-sending"
    elif _is_part_of(received, sent):
        key = "check-line-loses"
    elif _is_part_of(sent, received):
        key = "check-line-adds"
    probe.require(received == sent, key, **details)


def _is_part_of(some: bytes, whole: bytes) -> bool:
    """Return whether ``some`` is ``whole`` with bytes left out."""
    place = 0
    for byte in whole:
        if place < len(some) and some[place] == byte:
            place += 1
    return place == len(some)
