"""An image in the flash: a cut of power at any byte leaves the old one or the new one, whole.

Portable.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable
    from typing import Any

from motorcade.words.image import ImageError, parse_image_bytes

NEW = ".new"


class ImageFile:
    """The file at ``path``.

    Args:
        path: where the image is kept; while it is written a second file stands beside it.
        files: MicroPython's module os, or one like it.
        open_file: the function open, or one like it.
    """

    def __init__(self, path: str, files: "Any", open_file: "Callable[..., Any]") -> None:
        self._path = path
        self._files = files
        self._open = open_file

    def load(self) -> bytes | None:
        """The image's bytes, None where there is no whole one."""
        # On a FAT file system the old file goes before the new one takes its name: between the two the
        # new one alone is there.
        for path in (self._path, self._path + NEW):
            try:
                with self._open(path, "rb") as file:
                    data: bytes = file.read()
                parse_image_bytes(data)
            except (OSError, ImageError):
                continue
            return data
        return None

    def save(self, data: bytes) -> None:
        """Replace the image. Raises OSError; the old one is kept then."""
        new = self._path + NEW
        try:
            with self._open(new, "wb") as file:
                file.write(data)
            self._sync()
            self._files.rename(new, self._path)
            self._sync()
        except OSError:
            # A full flash would else stay full.
            self._remove(new)
            raise

    def _sync(self) -> None:
        # Not every port has it: those without write through.
        if hasattr(self._files, "sync"):
            self._files.sync()

    def _remove(self, path: str) -> None:
        try:
            self._files.remove(path)
        except OSError:
            pass
