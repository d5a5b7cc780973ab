"""Cameras of the web, of several makes, on a free port."""

import itertools
import threading
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

BOUNDARY = "a-boundary"


def part(picture, tells_length):
    length = b"content-length: %d\r\n" % len(picture) if tells_length else b""
    return b"--%s\r\nContent-Type: image/jpeg\r\n%s\r\n%s\r\n" % (BOUNDARY.encode(), length, picture)


class PictureServer(ThreadingHTTPServer):
    """A camera whose pictures are numbers, at ``url``; ``asked`` are the paths that it was asked for."""

    def __init__(self, kind, tells_length, tls):
        super().__init__(("127.0.0.1", 0), Pictures)
        if tls:
            self.socket = tls.wrap_socket(self.socket, server_side=True)
        self.url = f"http{'s' if tls else ''}://127.0.0.1:{self.server_port}/camera?token=secret"
        self.kind, self.tells_length = kind, tells_length
        self.asked: list[str] = []
        self.numbers = itertools.count(1)
        self.over = threading.Event()


class Pictures(BaseHTTPRequestHandler):
    """A camera; ``server.kind`` says which."""

    protocol_version = "HTTP/1.1"
    server: PictureServer

    def log_message(self, *said):
        pass

    def do_GET(self):
        self.server.asked.append(self.path)
        getattr(self, self.server.kind)()

    def answer(self, kind, body=b"", status=200, **headers):
        self.send_response(status)
        for name, value in ({"Content-Type": kind, "Content-Length": str(len(body))} | headers).items():
            self.send_header(name.replace("_", "-"), value)
        self.end_headers()
        self.wfile.write(body)

    def stream(self):
        self.send_response(200)
        self.send_header("Content-Type", f"multipart/x-mixed-replace; boundary={BOUNDARY}")
        self.end_headers()
        with suppress(OSError):
            while not self.server.over.wait(0.005):
                self.wfile.write(part(b"%d" % next(self.server.numbers), self.server.tells_length))
        self.close_connection = True

    def files(self):
        self.answer("image/jpeg", b"%d" % next(self.server.numbers))

    def page(self):
        self.answer("text/html", b"<html>")

    def elsewhere(self):
        self.answer("image/jpeg", b"", 302, Location=f"http://127.0.0.1:{self.server.server_port}/secret")

    def huge(self):
        with suppress(OSError):
            self.answer("image/jpeg", bytes((1 << 22) + 1))
        self.close_connection = True

    def nothing(self):
        self.answer("text/plain", b"", 401)

    def silence(self):
        self.server.over.wait()
        self.close_connection = True


@contextmanager
def picture_server(kind, tells_length=True, tls=None):
    """A camera that serves while the block runs."""
    with PictureServer(kind, tells_length, tls) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        try:
            yield server
        finally:
            server.over.set()
            server.shutdown()
            thread.join()
