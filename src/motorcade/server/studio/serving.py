"""The studio on a port of this computer."""

import os
import socket
import sys
import threading
import webbrowser
from collections.abc import Callable

from motorcade.drive.listener import bind
from motorcade.engine.world import World, warm_up
from motorcade.errors import MotorcadeError
from motorcade.mats import formation, open_table
from motorcade.server.addresses import url_of
from motorcade.server.running import serve_alone
from motorcade.server.studio.app import make_app
from motorcade.server.studio.settings import Settings


def listen(host: str, port: int) -> socket.socket:
    """A socket that listens at the address; port 0 takes a free one. Raises MotorcadeError."""
    try:
        return bind(host, port, "studio")
    except MotorcadeError as problem:
        if problem.code != "port-taken":
            raise
        raise MotorcadeError("studio-port-taken", port=port, url=url_of(host, port)) from None


def serve(settings: Settings, listener: socket.socket, ready: Callable[[], None]) -> None:
    """Serve on ``listener`` until Ctrl-C; ``ready`` is called once it answers."""

    def answers() -> None:
        threading.Thread(target=_compile_simulator, daemon=True).start()
        ready()

    serve_alone(make_app(settings), settings, listener, answers)


def open_browser(url: str) -> None:
    """Show ``url`` in the browser, if there is one with a window; doesn't wait for it."""
    # Without a display Python would take a browser for terminals, which would take ours.
    if sys.platform != "linux" or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()


def _compile_simulator() -> None:
    """Compile it after an install, while the user still looks around."""
    warm_up(World(open_table(formation(1)), [bytes(4)], threads=1))
