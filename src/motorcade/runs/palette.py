"""Give each word a colour, which is the same in every picture of a run."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from motorcade.words.image import parse_image_bytes

LEADER = "#d62728"
# Matplotlib's ten colours without red, which is for leaders, and grey, which is for cars without a word.
FOLLOWERS = ("#1f77b4", "#ff7f0e", "#2ca02c", "#9467bd", "#17becf", "#bcbd22", "#8c564b", "#e377c2")
LEDS = ("#ffd60a", "#00e5ff", "#b8ff3d", "#ff5cd6")
_LEADER_SHADES = ("#d62728", "#f0797a", "#9c1a1b", "#f9b3b3")
_NO_WORD = "#c4c4c4"
_UNKNOWN = "#6e6e6e"
_PALER = 0.68


def rgb(colour: str) -> tuple[float, float, float]:
    """Convert ``#rrggbb`` to three numbers from 0 to 1."""
    red, green, blue = (int(colour[place : place + 2], 16) / 255 for place in (1, 3, 5))
    return red, green, blue


class WordColours:
    """The colours of the words in images: various colours for followers' words, reds for leaders' words.

    Args:
        images: the images in hexadecimal.

    Attributes:
        words: the words, followers' first, in the order of the images.
        followers: how many of them are followers'.
        shades: float32 of shape (words + 2, 2, 3): red, green and blue of each word, at index 0 after its duration
            and at 1 while it runs. The last two rows are for no word, and for a word that is in no image.
    """

    def __init__(self, images: Sequence[str]):
        parts = [parse_image_bytes(bytes.fromhex(image)) for image in dict.fromkeys(images)]
        followers = dict.fromkeys(word for part in parts for word in part.followers)
        leaders = dict.fromkeys(word for part in parts for word in part.leader if word not in followers)
        self.words = (*followers, *leaders)
        self.followers = len(followers)
        colours = [FOLLOWERS[place % len(FOLLOWERS)] for place in range(len(followers))]
        colours += [_LEADER_SHADES[place % len(_LEADER_SHADES)] for place in range(len(leaders))]
        strong = np.array([rgb(each) for each in (*colours, _NO_WORD, _UNKNOWN)], np.float32)
        pale = strong + (1 - strong) * _PALER
        pale[-2] = strong[-2]
        self.shades: NDArray[np.float32] = np.stack([pale, strong], axis=1)
        self._sorted = np.argsort(np.array(self.words, np.uint32), kind="stable")
        self._known = np.array(self.words, np.uint32)[self._sorted]

    def places(self, words: NDArray[np.uint32]) -> NDArray[np.intp]:
        """The row of each word in ``shades``."""
        none, unknown = len(self._known), len(self._known) + 1
        if not none:
            return np.where(words == 0, none, unknown)
        found = np.minimum(np.searchsorted(self._known, words), none - 1)
        places = np.where(self._known[found] == words, self._sorted[found], unknown)
        return np.where(words == 0, none, places)

    def of(self, words: NDArray[np.uint32], runs: NDArray[np.bool_]) -> NDArray[np.float32]:
        """Red, green and blue for each word; paler where it no longer runs."""
        return self.shades[self.places(words), runs.astype(np.intp)]
