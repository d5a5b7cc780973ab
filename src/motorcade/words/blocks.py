"""What each platform does with a block of bytes by itself: Python by its own modules, C by memmove and a short loop."""

from binascii import crc32


def crc32_of(buffer: bytearray, begin: int, end: int, crc: int) -> int:
    """Return the CRC-32 of the bytes from ``begin`` up to ``end``, where ``crc`` is that of the bytes before (or 0)."""
    return crc32(memoryview(buffer)[begin:end], crc)


def move_to_start(buffer: bytearray, begin: int, end: int) -> None:
    """Copy the bytes from ``begin`` up to ``end`` to the start of ``buffer``."""
    buffer[: end - begin] = buffer[begin:end]
