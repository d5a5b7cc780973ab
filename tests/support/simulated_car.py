"""A simulated car that runs in a thread of its own."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from motorcade.boards.computer import ComputerBoard, Equipment, ImageStore, run
from motorcade.boards.lines import WaitingLine
from motorcade.config.profile import Profile, levels_of


@contextmanager
def simulated_car(line: WaitingLine, store: ImageStore, profile: Profile) -> Iterator[None]:
    """Run a simulated leader until the block ends. Raises StoreError."""
    board = ComputerBoard(Equipment(True, 0, levels_of(profile), line, store.load(), store.save))
    ended = threading.Event()
    thread = threading.Thread(target=run, args=(board, line.wait, ended.is_set), name="simulated car", daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
