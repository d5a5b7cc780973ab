"""Make the documentation's page of all blocks: a picture of each, its Python, and the words that it becomes."""

import re
from typing import Any

from motorcade.cli.console import describe_control, describe_flow, describe_state
from motorcade.cli.output import in_language
from motorcade.config.profile import built_in_profile
from motorcade.locales import page_text
from motorcade.program.compiler import compile_program
from motorcade.program.model import program_from_dict
from motorcade.program.python_writer import python_text
from motorcade.program.schema import FORMAT
from motorcade.words.image import format_at

_GO = {"drive": {"direction": "forward", "speed": 2, "seconds": 1}}
_STAND = {"wait": {"seconds": 1}}
# By the drawer of the page: a leader's step for each block; their pictures are in docs/pictures/blocks by these names.
SAMPLES: dict[str, dict[str, dict[str, Any]]] = {
    "drive": {
        "drive": {"drive": {"direction": "forward", "speed": 2, "seconds": 3}},
        "wait": {"wait": {"seconds": 2}},
        "follow_line": {"follow_line": {"speed": 2, "seconds": 3}},
        "turn_to_line": {"turn_to_line": {"direction": "left", "speed": 1, "seconds": 3}},
    },
    "light": {"led": {"led": {"which": 1, "seconds": 2}}},
    "sense": {
        "avoid": {"avoid": {"radius": 2, "seconds": 3}},
        "voice": {"voice": {"seconds": 3}},
        "pir": {"pir": {"seconds": 3}},
        "floor": {"floor": {"seconds": 3}},
    },
    "order": {
        "together": {"together": [_GO, {"led": {"which": 3, "seconds": 1}}]},
        "repeat": {"repeat": {"times": 2, "steps": [_GO, _STAND]}},
    },
    "decide": {
        "if_else": {"if": {"when": {"person": {}}, "then": [_STAND], "else": [_GO]}},
        "wait_until": {"wait": {}, "until": {"voice": "go"}},
        "repeat_until": {"repeat": {"until": {"obstacle": 2}, "steps": [_GO]}},
        "set": {"set": {"counter": "laps", "to": 0}},
        "change": {"change": {"counter": "laps", "by": 1}},
        "tell": {"tell": {"step": {"led": {"which": 2, "seconds": 1}}}},
    },
}
_DESCRIBE = {"control": describe_control, "state": describe_state, "flow": describe_flow}
_PROFILE = built_in_profile("classroom")
_INTRODUCTIONS = {
    "en": "# All blocks\n\nEach block below stands in the leader's program. Beside it stands what it is in Python, and "
    "the words that a car gets: 32 bits each, here in hexadecimal, and what they say. [Words](words.md) names every "
    "bit, [Programs](programs.md) every value.\n",
    "zh": "# 所有积木\n\n下面每块积木都放在头车的程序里。旁边是它的 Python 写法，以及小车得到的码字：每个 32 位，"
    "这里写成十六进制，后面是它的意思。[码字](words.zh.md)说明每一位，[程序](programs.zh.md)说明每个值。\n",
}
_COLUMNS = {"en": "| block | Python | words |", "zh": "| 积木 | Python | 码字 |"}


def sample_project(step: dict[str, Any]) -> dict[str, Any]:
    """The program whose leader does one step."""
    return {"format": FORMAT, "profile": "classroom", "leader": [step]}


def blocks_page(language: str) -> str:
    """Return the page in Markdown, in ``language`` (en or zh)."""
    parts = [_INTRODUCTIONS[language]]
    with in_language(language):
        for drawer, samples in SAMPLES.items():
            rows = [_row(name, step, language) for name, step in samples.items()]
            title = page_text(("drawers", drawer), language)
            parts.append("\n".join([f"## {title}\n", _COLUMNS[language], "|---|---|---|", *rows, ""]))
    return "\n".join(parts)


def _row(name: str, step: dict[str, Any], language: str) -> str:
    program = program_from_dict(sample_project(step))
    words = compile_program(program, _PROFILE).words
    said = [
        f"`{word:08X}` {_DESCRIBE[format_at(place, word, words[0]).name](word, _PROFILE)}"
        for place, word in enumerate(words)
        if place
    ]
    label = re.sub(r"\[.*?\]|%\d|\s+", " ", page_text(("blocks", name.removesuffix("_else")), language)).strip()
    ending = "" if language == "en" else f".{language}"
    code = "<br>".join(f"`{line}`" for line in _python(python_text(program)))
    return f"| ![{label}](pictures/blocks/{name}{ending}.webp) | {code} | {'<br>'.join(said)} |"


def _python(text: str) -> list[str]:
    """The lines of a program's text that are the step."""
    lines = [line.removeprefix("    ") for line in text.splitlines()]
    if "leader=[" in lines:
        return [line.strip().removesuffix(",") for line in lines[lines.index("leader=[") + 1 : lines.index("],")]]
    begin = next(number for number, line in enumerate(lines) if line.startswith("def leader"))
    return [line for line in lines[begin + 1 :] if line]
