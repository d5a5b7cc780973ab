"""Pictures that come by HTTP: cut any way, of several kinds of servers, newest only, and of no other address."""

import itertools
import threading
import time
from contextlib import suppress
from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.cameras import broadcast
from motorcade.cameras.broadcast import Parts, WebCamera
from motorcade.drive.certificates import CarKeys, make_keys
from motorcade.drive.keys import https_context, visitor_context
from motorcade.errors import MotorcadeError
from support.picture_server import BOUNDARY, part, picture_server
from support.waiting import wait_until


@given(
    st.lists(st.binary(max_size=60).filter(lambda picture: b"--a-b" not in picture), max_size=5),
    st.booleans(),
    st.lists(st.integers(1, 40)),
    st.sampled_from(["", "--"]),
)
def test_pictures_are_found_however_their_bytes_are_cut(pictures, tells_length, cuts, hyphens):
    body = b"".join(part(picture, tells_length) for picture in pictures) + f"--{BOUNDARY}--".encode()
    parts, found, at = Parts(hyphens + BOUNDARY), [], 0
    for cut in itertools.chain(cuts, itertools.repeat(7)):
        if at >= len(body):
            break
        found += parts.receive_data(body[at : at + cut])
        at += cut
    assert found == pictures


def test_a_part_without_an_end_is_given_up(monkeypatch):
    monkeypatch.setattr(broadcast, "_MOST_BYTES", 1000)
    parts = Parts(BOUNDARY)
    parts.receive_data(part(b"", tells_length=False) + bytes(900))
    with pytest.raises(ValueError, match="1000 bytes"):
        parts.receive_data(bytes(200))


@pytest.mark.parametrize("beginning", [b"", part(b"", tells_length=False), f"--{BOUNDARY}".encode()])
def test_a_camera_that_sends_byte_after_byte_costs_little(beginning):
    """Each byte once had all that came before searched again."""
    parts = Parts(BOUNDARY)
    begin_s = time.process_time()
    with suppress(ValueError):
        parts.receive_data(beginning + bytes(4_000_000))
        for _ in range(20_000):
            parts.receive_data(b"x")
    assert time.process_time() - begin_s < 1.0


@pytest.mark.parametrize(("kind", "tells_length"), [("stream", True), ("stream", False), ("files", True)])
def test_each_picture_is_a_new_one_of_any_kind_of_camera(kind, tells_length):
    with picture_server(kind, tells_length) as server:
        camera = WebCamera(server.url, patience_s=60)
        seen = [int(camera.jpeg()) for _ in range(5)]
        camera.close()
    assert seen == sorted(set(seen))
    assert server.asked[0] == "/camera?token=secret"


def test_who_looks_again_after_a_while_sees_nothing_old(monkeypatch):
    monkeypatch.setattr(broadcast, "_IDLE_S", 0.05)
    with picture_server("stream") as server:
        camera = WebCamera(server.url, patience_s=60)
        camera.jpeg()
        # Nobody asks: the connection ends, and nothing gathers in it.
        wait_until(lambda: all(thread.name != "web camera" for thread in threading.enumerate()))
        before = next(server.numbers)
        assert int(camera.jpeg()) > before
        assert len(server.asked) == 2
        camera.close()


@pytest.mark.parametrize(
    ("kind", "reason"),
    [
        *(("page", "text/html is no picture"), ("elsewhere", "302 Found"), ("nothing", "401"), ("silence", "")),
        ("huge", "more than 4194304 bytes"),
    ],
)
def test_what_gives_no_picture_is_a_sentence_that_keeps_the_token_secret(kind, reason):
    with picture_server(kind) as server:
        camera = WebCamera(server.url, patience_s=0.5 if kind == "silence" else 60)
        with pytest.raises(MotorcadeError) as failed:
            camera.jpeg()
        for language in ("en", "zh"):
            assert f"127.0.0.1:{server.server_port}/camera" in failed.value.sentence(language)
            assert reason in failed.value.sentence(language)
            assert "secret" not in failed.value.sentence(language)
        server.over.set()
        assert not any("/secret" in path for path in server.asked)


def test_by_https_a_car_shows_a_certificate_of_the_drivers_authority(tmp_path):
    make_keys(tmp_path, [CarKeys("ada")], ["lin"], datetime.now(UTC))
    with picture_server("files", tls=https_context(tmp_path / "car-ada.pem")) as server:
        camera = WebCamera(server.url, visitor_context(tmp_path / "driver-lin.pem"), patience_s=60)
        assert camera.jpeg().isdigit()
        camera.close()
        with pytest.raises(MotorcadeError, match="CERTIFICATE_VERIFY_FAILED"):
            WebCamera(server.url, visitor_context(None), patience_s=60).jpeg()


def test_a_camera_that_comes_back_gives_pictures_again():
    with picture_server("nothing") as server:
        camera = WebCamera(server.url, patience_s=60)
        with pytest.raises(MotorcadeError):
            camera.jpeg()
        server.kind = "files"

        def looks():
            with suppress(MotorcadeError):
                return camera.jpeg()

        assert wait_until(looks)
        camera.close()


@pytest.mark.parametrize("url", ["file:///etc/passwd", "ftp://127.0.0.1/a", "http://", "//127.0.0.1/camera", "camera"])
def test_only_addresses_of_the_web_are_cameras(url):
    with pytest.raises(MotorcadeError, match="is no address of pictures"):
        WebCamera(url)
