"""The image in the flash. A cut of power at any byte leaves the old image or the new one, whole.

Portable.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable
    from typing import Any

from binascii import crc32

NEW = ".new"
_CHECKSUM_BYTES = 4


class ImageFile:
    """An image in a file, and its CRC-32 behind it: a chip checks that much faster than each word.

    Args:
        path: of the file; while an image is written there is a second file beside it.
        files: MicroPython's module os.
        open_file: the function open.
    """

    def __init__(self, path: str, files: "Any", open_file: "Callable[..., Any]") -> None:
        self._path = path
        self._files = files
        self._open = open_file

    def load(self) -> bytes | None:
        """Return the image's bytes, None where there is no whole image."""
        # A FAT file system removes the old file before it renames the new one: in between there is only the new one.
        for path in (self._path, self._path + NEW):
            try:
                with self._open(path, "rb") as file:
                    data: bytes = file.read()
            except OSError:
                continue
            image = data[:-_CHECKSUM_BYTES]
            if image and data[-_CHECKSUM_BYTES:] == _checksum(image):
                return image
        return None

    def save(self, data: bytes) -> None:
        """Replace the image. Raises OSError; the old image is kept then."""
        new = self._path + NEW
        try:
            with self._open(new, "wb") as file:
                file.write(data + _checksum(data))
            self._sync()
            self._files.rename(new, self._path)
            self._sync()
        except OSError:
            # Otherwise a full flash would stay full.
            self._remove(new)
            raise

    def _sync(self) -> None:
        # Ports without sync write at once.
        if hasattr(self._files, "sync"):
            self._files.sync()

    def _remove(self, path: str) -> None:
        try:
            self._files.remove(path)
        except OSError:
            pass


def _checksum(data: bytes) -> bytes:
    return crc32(data).to_bytes(_CHECKSUM_BYTES, "big")
