"""Check a board's serial line: every byte that comes is given once, and every byte that is written leaves.

Portable.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable
    from typing import Any

from motorcade.car.check.parts import FRAME
from motorcade.car.check.probe import LONGEST_CALL_MS, BoardFailedError, Probe, brief
from motorcade.errors import Phrase

# Neither an image nor an answer to an upload begins with these bytes.
_SENT = b"check\n"
_WITHIN_MS = 500
_PAUSE_MS = 5
# The largest image at 115200 baud, which brings 11.5 bytes a ms, while ticks take as long as they do: some up to 20 ms.
_SAMPLE_BYTES = 2044
_TICKS = ((20, 230), (10, 115), (10, 115), (10, 115))
_BYTES_A_TICK = 230
_GIVES_UP_MS = 10000


def check_line(probe: Probe, say: "Callable[[bytes], Any] | None") -> None:
    """Note what is wrong with the serial line. ``say`` sends bytes to it."""
    probe.answer("read_serial", lambda value: type(value) is bytes, "bytes")
    probe.act("write_serial", b"ERR only a check of this board\n")
    try:
        if say is None:
            probe.miss("read_serial", "say")
        elif not probe.has_breach_of("read_serial") and _reads_a_little(probe, say):
            _check_reading(probe, say)
        _check_writing(probe)
    except BoardFailedError:
        pass


def check_line_while_sending(probe: Probe, say: "Callable[[bytes], Any] | None") -> None:
    """Note bytes of the serial line that are lost while infrared is sent, on a board that loses none otherwise."""
    if not probe.has_own("send_frame") or probe.has_breach_of("send_frame") or probe.has_breach_of("is_sending"):
        return

    def send() -> None:
        if not probe.call("is_sending"):
            probe.call("send_frame", FRAME)

    try:
        if say is not None and not probe.has_breach_of("read_serial"):
            _check_reading(probe, say, send)
        _check_writing(probe, send)
    except BoardFailedError:
        pass


def _reads_a_little(probe: Probe, say: "Callable[[bytes], Any]") -> bool:
    received = b""
    for _ in range(_WITHIN_MS // _PAUSE_MS):
        if not probe.call("read_serial"):
            break
        probe.wait(_PAUSE_MS)
    say(_SENT)
    for _ in range(_WITHIN_MS // _PAUSE_MS):
        received += probe.answer("read_serial", lambda value: type(value) is bytes, "bytes") or b""
        probe.wait(_PAUSE_MS)
    if received != _SENT:
        probe.breach(Phrase("check-line", method="read_serial", value=brief(received), sent=repr(_SENT)))
    return received == _SENT


def _check_reading(probe: Probe, say: "Callable[[bytes], Any]", send: "Callable[[], Any] | None" = None) -> None:
    sample, received = _sample(), b""
    said = ticks = 0
    while said < len(sample):
        tick_ms, count = _TICKS[ticks % len(_TICKS)]
        say(sample[said : said + count])
        if send is not None:
            send()
        probe.wait(tick_ms)
        received += probe.call("read_serial")
        said += count
        ticks += 1
    # A slower line brings the rest later.
    silent_ms = passed_ms = 0
    while silent_ms < _WITHIN_MS and passed_ms < _GIVES_UP_MS:
        probe.wait(LONGEST_CALL_MS)
        data = probe.call("read_serial")
        received += data
        silent_ms = 0 if data else silent_ms + LONGEST_CALL_MS
        passed_ms += LONGEST_CALL_MS
    _compare(probe, "read_serial", received, sample, send is not None)


def _check_writing(probe: Probe, send: "Callable[[], Any] | None" = None) -> None:
    written_bytes = probe.offer("write_serial", "written_bytes")
    if written_bytes is None or probe.has_breach_of("write_serial"):
        return
    sample, at_once = _sample(), min(getattr(probe.board, "bytes_a_tick", _BYTES_A_TICK), _BYTES_A_TICK)
    written_bytes()
    written = b""
    for place in range(0, len(sample), at_once):
        probe.call("write_serial", sample[place : place + at_once])
        if send is not None:
            send()
        probe.wait(LONGEST_CALL_MS)
        written += written_bytes()
    for _ in range(_WITHIN_MS // LONGEST_CALL_MS):
        probe.wait(LONGEST_CALL_MS)
        written += written_bytes()
    _compare(probe, "write_serial", written, sample, send is not None)


def _sample() -> bytes:
    """Return bytes of every value, also line ends, zeros and those that end a line in some terminals."""
    return bytes([(value * 7 + value // 256) & 0xFF for value in range(64, 64 + _SAMPLE_BYTES)])


def _compare(probe: Probe, method: str, received: bytes, sent: bytes, while_sending: bool) -> None:
    if received == sent:
        return
    place = 0
    while place < min(len(received), len(sent)) and received[place] == sent[place]:
        place += 1
    details: dict[str, Any] = {"method": method, "received": len(received), "sent": len(sent), "place": place}
    details["expected"] = f"0x{sent[place]:02X}" if place < len(sent) else Phrase("check-none")
    details["got"] = f"0x{received[place]:02X}" if place < len(received) else Phrase("check-none")
    key = "check-line-changes"
    if while_sending:
        key = "check-line-while-sending"
    elif _is_part_of(received, sent):
        key = "check-line-loses"
    elif _is_part_of(sent, received):
        key = "check-line-adds"
    probe.breach(Phrase(key, **details))


def _is_part_of(some: bytes, whole: bytes) -> bool:
    """Return whether ``some`` is ``whole`` with bytes left out."""
    place = 0
    for byte in whole:
        if place < len(some) and some[place] == byte:
            place += 1
    return place == len(some)
