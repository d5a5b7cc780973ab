"""Start the shell in the worker of a page, with the parts that Pyodide needs."""

import time

from motorcade.browser.kernels import OpenInstance, make_world, play
from motorcade.browser.shell import CAPABILITIES, Parts, Shell
from motorcade.browser.storage import BrowserStorage
from motorcade.service.studio_world import StudioWorld
from motorcade.service.world_messages import SetWorld


def start(open_instance: OpenInstance) -> Shell:
    """Return the shell of this worker, in which each world has an instance of engine.wasm of its own."""

    def make(message: SetWorld) -> StudioWorld:
        return make_world(message, open_instance, CAPABILITIES.most_cars)

    return Shell(Parts(BrowserStorage(), make, time.perf_counter, play(open_instance)))
