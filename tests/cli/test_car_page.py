"""A served car's own page, as its owner starts it: where it is, what it sees, and who may open it."""

import ssl
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from io import BytesIO
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from PIL import Image

from motorcade.drive.certificates import CarKeys, make_keys
from support.command_line import PARADE, refusal, started
from support.waiting import DEADLINE_S

MATS = PARADE.parent / "mats"


@contextmanager
def served(*options: str) -> Iterator[dict]:
    """What a car with a page prints."""
    with started("drive", "serve", "--port", "0", "--web", "0", *options) as (_, told):
        yield told


def got(url: str, context: ssl.SSLContext | None = None) -> bytes:
    with urllib.request.urlopen(url, timeout=DEADLINE_S, context=context) as answer:
        return answer.read()


def test_a_simulated_car_on_a_mat_shows_what_it_sees() -> None:
    with served("--mat", str(MATS / "classroom.toml"), "--program", str(PARADE)) as told:
        url = told["url"]
        assert urlsplit(url).hostname == "127.0.0.1"
        assert urlsplit(url).path == "/drive"
        picture = Image.open(BytesIO(got(url.replace("/drive", "/camera/snapshot.jpg"))))
        assert picture.format == "JPEG"


def test_with_keys_a_car_listens_anywhere_and_its_page_comes_by_https_and_wants_its_token(tmp_path: Path) -> None:
    make_keys(tmp_path, [CarKeys("ada")], [], datetime.now(UTC))
    with served("--host", "0.0.0.0", "--keys", str(tmp_path / "car-ada.pem")) as told:
        url = told["url"]
        scheme, _, _, query, _ = urlsplit(url)
        assert (told["tls"], scheme, query[:6]) == (True, "https", "token=")
        # Nobody has revoked any keys yet.
        assert told["revoked_problem"] is None
        trust = ssl.create_default_context(cafile=str(tmp_path / "authority.crt"))
        snapshot = f"https://127.0.0.1:{urlsplit(url).port}/camera/snapshot.jpg"
        with pytest.raises(urllib.error.HTTPError, match="401"):
            got(snapshot, trust)
        assert got(f"{snapshot}?{query}", trust)


def test_what_is_for_simulated_cars_is_refused_for_real_ones(tmp_path: Path) -> None:
    (tmp_path / "pins.toml").touch()
    real = ("drive", "serve", "--port", "0", "--board", "raspberry-pi", "--pins", tmp_path / "pins.toml")
    for option, file in (("--mat", MATS / "classroom.toml"), ("--program", PARADE)):
        assert "--mat and --program are for simulated cars" in refusal(2, *real, option, file)
