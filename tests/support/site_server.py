"""A folder of static files, served as any web server would, below a path: in a thread, on a free port.

The page's policy comes as a header too: only so does it hold for workers. Browsers report here what breaks it.
"""

import json
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from motorcade.browser.site import POLICY

PATH = "/motorcade/"
# Where browsers send their reports, workers' too.
REPORTS = f"{PATH}policy-reports"


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    # A page asks for fifty files at once.
    request_queue_size = 128

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say what went wrong, but not that a page was left."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


class SiteServer:
    """Serves ``folder`` at ``url`` until it is stopped.

    Attributes:
        requests: the paths below the url, in order.
        violations: what a page or a worker wanted to do against the policy, as browsers report it.
    """

    def __init__(self, folder: Path, port: int = 0) -> None:
        self.folder = folder
        self.requests: list[str] = []
        self.violations: list[str] = []
        requests, violations = self.requests, self.violations

        class Handler(SimpleHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def translate_path(self, path: str) -> str:
                if not path.startswith(PATH):
                    return str(folder / "no such file")
                requests.append(path.removeprefix(PATH).partition("?")[0])
                return super().translate_path(path.removeprefix(PATH[:-1]))

            def do_POST(self) -> None:
                report = self.rfile.read(int(self.headers["Content-Length"]))
                if self.path == REPORTS:
                    told = json.loads(report)["csp-report"]
                    violations.append(
                        f"{told['violated-directive']}: {told['blocked-uri']} ({told.get('source-file')})"
                    )
                self.send_response(204 if self.path == REPORTS else 404)
                self.send_header("Content-Length", "0")
                self.end_headers()

            def end_headers(self) -> None:
                self.send_header("Content-Security-Policy", f"{POLICY}; report-uri {REPORTS}")
                super().end_headers()

            def log_message(self, *_: object) -> None:
                pass

        self._server = _Server(("127.0.0.1", port), lambda *arguments: Handler(*arguments, directory=str(folder)))
        self.port = self._server.server_address[1]
        self.url = f"http://127.0.0.1:{self.port}{PATH}"
        threading.Thread(target=self._server.serve_forever, args=(0.05,), daemon=True).start()

    def stop(self) -> None:
        """Cut the connection: nothing listens at the port any more."""
        self._server.shutdown()
        self._server.server_close()


@contextmanager
def serving(folder: Path) -> Iterator[SiteServer]:
    """A server for the length of a ``with`` block."""
    server = SiteServer(folder)
    try:
        yield server
    finally:
        server.stop()
