"""The studio on a port of this computer."""

import errno
import os
import socket
import sys
import threading
import webbrowser
from collections.abc import Callable

from motorcade.server.addresses import url_of
from motorcade.server.running import serve_alone
from motorcade.sim.mat import formation, open_table
from motorcade.sim.rehearsal import rehearse
from motorcade.sim.world import World
from motorcade.studio.app import make_app
from motorcade.studio.settings import Settings


class AddressError(OSError):
    """An address that the studio can't listen at; the sentence says what to do."""


def listen(host: str, port: int) -> socket.socket:
    """A socket that listens at the address; port 0 takes a free one. Raises AddressError."""
    try:
        family, *_, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        return socket.create_server((str(address[0]), port), family=family, backlog=socket.SOMAXCONN)
    except (socket.gaierror, UnicodeError):
        raise AddressError(f"--host {host[:60]} is no address of this computer; 127.0.0.1 is, 0.0.0.0 is all") from None
    except OSError as problem:
        if problem.errno == errno.EADDRINUSE:
            raise AddressError(
                f"port {port} is taken. Perhaps the studio runs already: open {url_of(host, port)}, "
                "or take another port with --port"
            ) from None
        reason = problem.strerror or type(problem).__name__
        raise AddressError(f"the studio can't listen at {host} port {port}: {reason}; take another") from None


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
    rehearse(World(open_table(formation(1)), [bytes(4)], threads=1))
