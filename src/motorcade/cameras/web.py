"""A camera whose pictures come by HTTP, such as the one of a car's own page: MJPEG, or a JPEG file for each request."""

import http.client
import ssl
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from urllib.parse import urlsplit

from motorcade.cameras.broadcast import RATE_HZ
from motorcade.cameras.camera_failures import CameraError

_PATIENCE_S = 2.0
# Who looks asks many times a second; when nobody does any more the connection ends.
_IDLE_S = 1.0
_AGAIN_S = 0.5
_MOST_BYTES = 1 << 22
_CHUNK_BYTES = 1 << 16
_MULTIPART, _JPEG = "multipart/x-mixed-replace", "image/jpeg"


class Parts:
    """The pictures in a body of multipart/x-mixed-replace, whichever way its bytes are cut. Pure.

    Args:
        boundary: what stands between two of them, without its leading hyphens.
        most_bytes: of one part, with its headers.
    """

    def __init__(self, boundary: str, most_bytes: int = _MOST_BYTES) -> None:
        # Some servers say the hyphens too.
        self._boundary = b"--" + boundary.removeprefix("--").encode("latin-1")
        self._most_bytes = most_bytes
        self._rest = bytearray()

    def take(self, data: bytes) -> list[bytes]:
        """The pictures that are whole now. Raises ValueError where one is too large to be one."""
        self._rest += data
        pictures = []
        while (picture := self._next()) is not None:
            pictures.append(picture)
        if len(self._rest) > self._most_bytes:
            raise ValueError(f"more than {self._most_bytes} bytes without an end")
        return pictures

    def _next(self) -> bytes | None:
        begin = self._rest.find(self._boundary)
        head_end = self._rest.find(b"\r\n\r\n", begin)
        if begin < 0 or head_end < 0:
            return None
        body = head_end + 4
        length = _length(bytes(self._rest[begin:head_end]))
        end = self._rest.find(self._boundary, body) if length is None else body + length
        if end < body or end > len(self._rest):
            return None
        picture = bytes(self._rest[body:end])
        del self._rest[:end]
        return picture if length is not None else picture.removesuffix(b"\r\n")


def _length(head: bytes) -> int | None:
    for line in head.split(b"\r\n"):
        name, _, value = line.partition(b":")
        if name.strip().lower() == b"content-length" and value.strip().isdigit():
            return int(value)
    return None


class WebCamera:
    """The pictures at one address, taken while somebody asks for them; redirections aren't followed.

    Args:
        url: http:// or https://, whatever else it needs, such as ``token=``, in it.
        trust: whom an https:// address has to be; what this computer trusts, unless given.
        patience_s: a camera that gives nothing for so long gives nothing.
        idle_s: the connection ends when nobody has asked for so long.

    Raises:
        ValueError: the address is none.
    """

    def __init__(
        self,
        url: str,
        trust: ssl.SSLContext | None = None,
        patience_s: float = _PATIENCE_S,
        idle_s: float = _IDLE_S,
    ) -> None:
        parts = urlsplit(url)
        if parts.scheme not in ("http", "https") or not parts.hostname:
            raise ValueError(f"'{url[:60]}' is no address of pictures, such as http://192.168.1.20:7700/camera")
        self._host, self._port = parts.hostname, parts.port
        self._path = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
        # What may be shown of it: a token is a secret.
        self._shown = f"{parts.scheme}://{parts.netloc.rpartition('@')[2]}{parts.path}"
        self._tls = (trust or ssl.create_default_context()) if parts.scheme == "https" else None
        self._patience_s = patience_s
        self._idle_s = idle_s
        self._changed = threading.Condition()
        self._reader: threading.Thread | None = None
        self._asked_s = 0.0
        self._newest = b""
        self._given = self._count = 0
        self._problem = ""
        self._closed = False

    def jpeg(self) -> bytes:
        """A picture that wasn't given yet. Raises CameraError."""
        with self._changed:
            self._asked_s = time.monotonic()
            if self._reader is None and not self._closed:
                # What was read for those who looked before is old.
                self._given = self._count
                self._problem = ""
                self._reader = threading.Thread(target=self._read, name="web camera", daemon=True)
                self._reader.start()
            self._changed.wait_for(lambda: self._count != self._given or self._problem, self._patience_s)
            if self._count == self._given:
                raise CameraError("no-answer", where=self._shown, reason=self._problem or "it is silent")
            self._given = self._count
            return self._newest

    def close(self) -> None:
        """Hang up, as soon as something comes or the patience is over."""
        with self._changed:
            self._closed = True

    def _read(self) -> None:
        """Read for as long as somebody looks, so that nothing old gathers on its way."""
        try:
            for picture in self._pictures():
                if not self._show(picture):
                    return
            problem = "it has ended"
        except (OSError, http.client.HTTPException, ValueError) as caught:
            problem = str(caught) or type(caught).__name__
        with self._changed:
            self._problem = problem
            self._changed.notify_all()
        time.sleep(_AGAIN_S)
        with self._changed:
            self._reader = None

    def _show(self, picture: bytes) -> bool:
        """Whether somebody looks, who has it now."""
        with self._changed:
            self._newest = picture
            self._count += 1
            self._changed.notify_all()
            is_wanted = not self._closed and time.monotonic() - self._asked_s < self._idle_s
            if not is_wanted:
                self._reader = None
            return is_wanted

    def _pictures(self) -> Iterator[bytes]:
        """The camera's pictures as they come. Raises OSError, HTTPException, ValueError."""
        with closing(self._line()) as line:
            while True:
                line.request("GET", self._path)
                answer = line.getresponse()
                if answer.status != http.HTTPStatus.OK:
                    raise OSError(f"{answer.status} {answer.reason}"[:60])
                kind = answer.headers.get_content_type()
                if kind == _MULTIPART:
                    yield from _parts_of(answer)
                    return
                if kind != _JPEG:
                    raise OSError(f"{kind[:40]} is no picture")
                picture = answer.read(_MOST_BYTES + 1)
                if len(picture) > _MOST_BYTES:
                    raise OSError(f"more than {_MOST_BYTES} bytes")
                yield picture
                time.sleep(1 / RATE_HZ)

    def _line(self) -> http.client.HTTPConnection:
        if self._tls:
            return http.client.HTTPSConnection(self._host, self._port, timeout=self._patience_s, context=self._tls)
        return http.client.HTTPConnection(self._host, self._port, timeout=self._patience_s)


def _parts_of(answer: http.client.HTTPResponse) -> Iterator[bytes]:
    parts = Parts(str(answer.headers.get_param("boundary", "")))
    while data := answer.read1(_CHUNK_BYTES):
        # Of those that came at once the newest is the one to see.
        yield from parts.take(data)[-1:]
