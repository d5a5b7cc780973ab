"""What is said while the simulator is compiled, which happens once on a computer."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from motorcade.cli.options import current_language

TEXTS = {
    "en": "The simulator is being compiled for this computer, once; that takes up to a minute.",
    "zh": "正在为这台电脑编译模拟器，只需一次，最长一分钟。",
}


@contextmanager
def told_of_compiling() -> Iterator[None]:
    """Inside, who sits at a terminal is told if the simulator has to be compiled."""
    from motorcade.engine.native import telling

    def tell() -> None:
        if sys.stderr.isatty():
            print(TEXTS[current_language()], file=sys.stderr, flush=True)

    with telling(tell):
        yield
