"""Start the shell in the worker of a page, with the parts that Pyodide needs."""

import time

from motorcade.browser.shell import Parts, Shell
from motorcade.browser.storage import BrowserStorage


def start() -> Shell:
    """Return the shell of this worker."""
    return Shell(Parts(storage=BrowserStorage(), make_world=None, clock=time.perf_counter))  # type: ignore[arg-type]
