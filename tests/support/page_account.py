"""What the page says about a world, from the page's own sources in Node; and the page's end of a world's session."""

import base64
import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any, Self

import msgspec

from motorcade.locales import catalogue
from motorcade.service.world_messages import Shown, WorldAnswer, WorldMessage
from motorcade.service.world_session import WorldSession
from support.pictures import Picture

_SCRIPT = Path(__file__).with_suffix(".mjs")


class PageAccount:
    """A page in Node that gets what a service sends; a context manager."""

    def __enter__(self) -> Self:
        command = [str(Path(sys.executable).with_name("node")), str(_SCRIPT)]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, encoding="utf-8", bufsize=1
        )
        return self

    def __exit__(self, *_: object) -> None:
        assert self._process.stdin
        assert self._process.stdout
        self._process.stdin.close()
        self._process.wait(20)
        self._process.stdout.close()

    def do(self, **order: Any) -> None:
        """Send an order of `page_account.mjs`."""
        assert self._process.stdin
        self._process.stdin.write(json.dumps(order) + "\n")
        self._process.stdin.flush()

    def ask(self, language: str, **more: Any) -> dict[str, Any]:
        """What the page says now."""
        self.do(ask=language, **more)
        assert self._process.stdout
        return json.loads(self._process.stdout.readline())


class WorldOnPage:
    """A world's session and the page that shows it: all that the session sends reaches the page, which draws it.

    Attributes:
        picture: the newest one.
    """

    def __init__(self, session: WorldSession, page: PageAccount) -> None:
        self.session, self.page = session, page
        self.picture: Picture | None = None
        self._now_s = 0.0

    def send(self, message: WorldMessage) -> None:
        """Let the page request something."""
        self.take(self.session.receive(message))

    def take(self, answers: list[WorldAnswer] | list[WorldAnswer | bytes]) -> None:
        """Bring answers to the page, then what follows from them: a picture and a state."""
        self._bring(answers)
        self._now_s += 1.0
        self._bring(self.session.advance(self._now_s))

    def _bring(self, answers: list[WorldAnswer] | list[WorldAnswer | bytes]) -> None:
        for answer in answers:
            if isinstance(answer, bytes):
                self.picture = Picture(answer)
                self.page.do(bytes=base64.b64encode(answer).decode())
                self.session.receive(Shown(self.picture.number))
            else:
                self.page.do(answer=msgspec.json.encode(answer).decode())


def claims_of(sentence: str, language: str) -> dict[str, int]:
    """What a caption claims: how many of whom do what, by the keys of the catalogue. Fails on any other sentence."""
    texts = catalogue(language)["page"]["mat"]["account"]
    if not sentence:
        return {}
    assert sentence.endswith(texts["end"])
    claims: dict[str, int] = {}
    for part in sentence.removesuffix(texts["end"]).split(texts["between"]):
        key, count = next(found for found in _matches(part, texts) if found)
        assert key not in claims, sentence
        claims[key] = count
    return claims


def _matches(part: str, texts: dict[str, Any]) -> Any:
    """The claims that a part of a sentence could be; in a singular form without a number it is one."""
    flat = {f"{who}.{what}": text for who in ("leaders", "followers") for what, text in texts[who].items()}
    flat |= {key: text for key, text in texts.items() if isinstance(text, str) and key.startswith(("lit_", "lost_"))}
    # A claim without a number: some were lost.
    flat["lost_some"] = texts["someLost"]
    for key, text in flat.items():
        pattern = re.escape(text).replace(r"\{\{count\}\}", r"(\d+)").replace(r"\{\{seconds\}\}", "5")
        if found := re.fullmatch(pattern, part):
            count = int(found[1]) if found.groups() else 1
            name, form = key.rsplit("_", 1)
            # English has a form for one, and a form for other numbers.
            if form in ("one", "some") or count != 1 or name + "_one" not in flat:
                yield name, count
    raise AssertionError(f"no such claim: {part}")
