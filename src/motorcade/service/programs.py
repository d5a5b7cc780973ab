"""Routes about programs: compile, open, save as text, decompile, and what words and levels mean."""

from dataclasses import asdict
from math import gcd
from typing import Any

from msgspec import Struct
from starlette.requests import Request
from starlette.routing import BaseRoute

from motorcade.program.decompiler import DecompileError, decompile
from motorcade.program.diagnostics import LANGUAGES
from motorcade.program.timing import MOST_PIECES
from motorcade.server.http import get, post
from motorcade.server.studio.settings import Settings
from motorcade.service.compiling import Blocks, compiled_blocks, profile_named
from motorcade.service.documents import Project, laid_out, opened, project_text
from motorcade.service.errors import StudioError
from motorcade.service.mats import mat_from
from motorcade.words.field import WordFormat
from motorcade.words.formats import CONTROL, HEADER
from motorcade.words.image import ImageError, bytes_to_words

_TITLES = {
    "leader_states": {"en": "leader's words", "zh": "主机码字数"},
    "follower_words": {"en": "followers' words", "zh": "从机码字数"},
    "dwell": {"en": "sending time", "zh": "发送时长"},
    "reserved": {"en": "reserved", "zh": "保留"},
    "accept_ir": {"en": "accepts infrared", "zh": "接受红外"},
    "forward": {"en": "passes on", "zh": "转发"},
    "motor_enable": {"en": "motor on", "zh": "电机启用"},
    "motor_direction": {"en": "direction", "zh": "方向"},
    "motor_speed": {"en": "speed", "zh": "速度"},
    "motor_duration": {"en": "motor's time", "zh": "电机时长"},
    "led_which": {"en": "which LED", "zh": "LED 编号"},
    "led_duration": {"en": "LED's time", "zh": "LED 时长"},
    "avoid_enable": {"en": "avoidance on", "zh": "避障启用"},
    "avoid_radius": {"en": "avoidance radius", "zh": "避障半径"},
    "avoid_duration": {"en": "avoidance's time", "zh": "避障时长"},
    "voice": {"en": "voice", "zh": "语音"},
    "pir": {"en": "person sensor", "zh": "人体红外"},
    "parity": {"en": "parity", "zh": "校验位"},
}


class Text(Struct):
    """A project file's text."""

    text: str


class Image(Struct):
    """An image's bytes, as base64."""

    image: bytes


class Place(Struct):
    """A mat."""

    mat: dict[str, Any]


def routes(settings: Settings) -> list[BaseRoute]:
    """All that is asked about a program."""

    def check_mat(place: Place) -> dict[str, Any]:
        mat = mat_from(place.mat, settings.most_cars)
        return {"cars": len(mat.starts.x_m), "leads": mat.starts.leads.nonzero()[0].tolist()}

    return [
        get("/api/formats", lambda request: {"header": _fields(HEADER), "control": _fields(CONTROL)}),
        get("/api/profile", _profile),
        post("/api/compile", Blocks, compiled_blocks),
        post("/api/open", Text, lambda file: opened(file.text)),
        post("/api/project", Project, lambda project: {"text": project_text(project)}),
        post("/api/decompile", Image, _decompiled),
        post("/api/mat", Place, check_mat),
    ]


def _fields(word_format: WordFormat) -> list[dict[str, Any]]:
    return [
        {"name": field.name, "high": field.high, "low": field.low, "title": _TITLES[field.name]}
        for field in word_format.fields
    ]


def _profile(request: Request) -> dict[str, Any]:
    profile = profile_named(request.query_params.get("name", "classroom"))
    seconds = {
        "least": 0,
        "step": gcd(*profile.durations_ms) / 1000,
        "most": MOST_PIECES * profile.durations_ms[-1] / 1000,
    }
    return {**asdict(profile), "seconds": seconds}


def _decompiled(sent: Image) -> Project:
    try:
        return laid_out(decompile(bytes_to_words(sent.image)))
    except ImageError as problem:
        raise StudioError(problem.code) from None
    except DecompileError as problem:
        raise StudioError("not-decompiled", reason={each: problem.message(each) for each in LANGUAGES}) from None
