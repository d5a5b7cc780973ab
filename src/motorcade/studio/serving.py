"""The studio on a port of this computer."""

import errno
import ipaddress
import os
import socket
import sys
import threading
import webbrowser
from collections.abc import Callable
from contextlib import suppress

import uvicorn

from motorcade.sim.mat import Pose, formation, open_table
from motorcade.sim.world import World
from motorcade.studio.app import make_app
from motorcade.studio.settings import Settings

# So many as fifty pages open at once, and a server that somebody floods still answers.
_MOST_CONNECTIONS = 1000
_PATIENCE_S = 2


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


def is_loopback(listener: socket.socket) -> bool:
    """Whether only this computer can reach the socket."""
    return _address(listener).is_loopback


def names_of(listener: socket.socket, host: str) -> list[str]:
    """The names by which pages may reach the socket, which listens at ``host``; the best to show is the first."""
    names = [host.lower()]
    if is_loopback(listener):
        return names
    name = socket.gethostname().lower()
    others = [name, f"{name.partition('.')[0]}.local", socket.getfqdn().lower()]
    # 'All addresses' is none that a page could be opened at.
    return others + names if _address(listener).is_unspecified else names + others


def url_of(host: str, port: int, token: str | None = None) -> str:
    """The page's address."""
    return f"http://{f'[{host}]' if ':' in host else host}:{port}/" + (f"?token={token}" if token else "")


def serve(settings: Settings, listener: socket.socket, ready: Callable[[], None]) -> None:
    """Serve on ``listener`` until Ctrl-C; ``ready`` is called once it answers."""
    config = uvicorn.Config(
        make_app(settings),
        log_level="warning",
        access_log=False,
        # Nobody stands between: a header that says who asks would be anybody's invention.
        proxy_headers=False,
        server_header=False,
        ws_max_size=settings.most_body,
        # Pictures don't shrink much, and thirty a second for each page would cost more than they save.
        ws_per_message_deflate=False,
        limit_concurrency=_MOST_CONNECTIONS,
        timeout_graceful_shutdown=_PATIENCE_S,
    )
    with suppress(KeyboardInterrupt):
        _Server(config, ready).run(sockets=[listener])


def open_browser(url: str) -> None:
    """Show ``url`` in the browser, if there is one with a window; doesn't wait for it."""
    # Without a display Python would take a browser for terminals, which would take ours.
    if sys.platform != "linux" or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()


class _Server(uvicorn.Server):
    def __init__(self, config: uvicorn.Config, ready: Callable[[], None]):
        super().__init__(config)
        self._ready = ready

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if self.started:
            threading.Thread(target=_compile_simulator, daemon=True).start()
            self._ready()


def _compile_simulator() -> None:
    """Does what compiles the simulator after an install, while the user still looks around."""
    world = World(open_table(formation(1)), [bytes(4)], events=True, threads=1)
    world.step()
    world.move(0, Pose(0, 0))
    world.snapshot()


def _address(listener: socket.socket) -> ipaddress.IPv4Address | ipaddress.IPv6Address:
    return ipaddress.ip_address(listener.getsockname()[0].partition("%")[0])
