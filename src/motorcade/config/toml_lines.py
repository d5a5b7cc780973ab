"""Where in a TOML text a value stands; Python's reader keeps no lines."""

import tomllib
from typing import Any

Path = tuple[str | int, ...]


class TomlLines:
    """The lines of a TOML text that is valid as a whole.

    A value stands on the line with which the text up to there, read by itself,
    first holds it; so this can't differ from what the reader makes of brackets,
    quotes and comments. It reads the text once a line, hence is for short texts.
    """

    def __init__(self, text: str) -> None:
        self._lines = text.split("\n")

    def line_of(self, path: Path) -> int:
        """The line, from 1, on which the value at ``path`` (keys and list positions) is complete."""
        for count in range(1, len(self._lines)):
            if _holds(self._read(count), path):
                return count
        return len(self._lines)

    def _read(self, count: int) -> Any:
        try:
            return tomllib.loads("\n".join(self._lines[:count]))
        except tomllib.TOMLDecodeError:
            return None


def _holds(value: Any, path: Path) -> bool:
    for key in path:
        try:
            value = value[key]
        except (KeyError, IndexError, TypeError):
            return False
    return True
