"""The studio on a port of this computer."""

import errno
import os
import socket
import sys
import threading
import webbrowser
from collections.abc import Callable

from motorcade.drive import addresses
from motorcade.engine.world import World, warm_up
from motorcade.errors import Sentences
from motorcade.mats import formation, open_table
from motorcade.server.addresses import url_of
from motorcade.server.running import serve_alone
from motorcade.server.studio.app import make_app
from motorcade.server.studio.settings import Settings

_SENTENCES: Sentences = {
    **addresses.AddressError.SENTENCES,
    "taken": {
        "en": "port {port} is taken. Perhaps the studio runs already: open {url}, or take another port with --port",
        "zh": "端口 {port} 已被占用。工作室可能已在运行：请打开 {url}，或用 --port 换一个端口",
    },
    "unusable": {
        "en": "the studio can't listen at {host} port {port}: {reason}; take another",
        "zh": "工作室无法监听 {host} 的端口 {port}：{reason}；请换一个",
    },
}


class AddressError(addresses.AddressError):
    """An address that the studio can't listen at; the sentence says what to do."""

    SENTENCES = _SENTENCES


def listen(host: str, port: int) -> socket.socket:
    """A socket that listens at the address; port 0 takes a free one. Raises AddressError."""
    try:
        family, *_, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        return socket.create_server((str(address[0]), port), family=family, backlog=socket.SOMAXCONN)
    except (socket.gaierror, UnicodeError):
        raise AddressError("no-address", host=host[:60]) from None
    except OSError as problem:
        if problem.errno == errno.EADDRINUSE:
            raise AddressError("taken", port=port, url=url_of(host, port)) from None
        reason = problem.strerror or type(problem).__name__
        raise AddressError("unusable", host=host[:60], port=port, reason=reason) from None


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
