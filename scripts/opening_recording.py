"""Record what a first visit of the site finds: the text of opening.json in src/motorcade/browser/.

It is what a page's session sends while the opening's cars drive for some seconds, so the page shows it before Python
runs. The bits of a world are the same everywhere, so Python takes the same world over at any of its pictures.
"""

import json
from base64 import b64encode
from collections.abc import Iterator
from typing import Any

import msgspec

from motorcade.browser.shell import CAPABILITIES
from motorcade.service.documents import opening
from motorcade.service.history import header_of
from motorcade.service.messages import Blocks, Project
from motorcade.service.programs import compile_blocks
from motorcade.service.studio_world import open_world
from motorcade.service.world_messages import Play, SetWorld, Shown
from motorcade.service.world_session import WorldSession

# So long a slow computer may take until Python runs; 20 pictures a second are drawn smoothly.
SECONDS = 30
PICTURES_A_SECOND = 20


def opening_recording(project: Project | None = None, seconds: int = SECONDS) -> str:
    """Return a JSON document, a line for each message.

    It has the project, the requests that its page makes with their answers (``blocks`` and ``compiled``, ``set`` and
    ``hello``), and ``messages``: all that the world sends, pictures as base64. The first picture is of a world that
    stands; what comes after the second state is of one that plays.
    """
    project = project or opening()
    blocks = Blocks(project.leader, project.followers, project.profile)
    compiled = compile_blocks(blocks)
    assert project.mat, "the first project has a mat"
    message = SetWorld(project.mat, compiled.image, project.profile, range_mm=project.range_mm)
    session = WorldSession("", lambda asked: open_world(asked, CAPABILITIES.most_cars))
    hello, *rest = session.receive(message)
    parts: dict[str, Any] = {"project": project, "blocks": blocks, "compiled": compiled, "set": message, "hello": hello}
    lines = [f'"{name}": {_text(part)}' for name, part in parts.items()]
    sent = [*rest, *_shown(session, 0.0), *session.receive(Play())]
    for number in range(seconds * PICTURES_A_SECOND + 1):
        sent += _shown(session, number / PICTURES_A_SECOND)
    messages = ",\n".join(_text(answer) for answer in sent)
    return "{" + ",\n".join([*lines, f'"messages": [\n{messages}\n]']) + "}\n"


def _shown(session: WorldSession, now_s: float) -> Iterator[Any]:
    """Yield what a session sends at a time to a page that draws each picture."""
    for answer in session.advance(now_s):
        if isinstance(answer, bytes):
            session.receive(Shown(header_of(answer).number))
        yield answer


def _text(answer: Any) -> str:
    if isinstance(answer, bytes):
        return json.dumps(b64encode(answer).decode())
    return msgspec.json.encode(answer).decode()
