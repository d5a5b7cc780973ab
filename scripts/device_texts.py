"""Find the texts that declared devices lack in the files of locales/."""

import json
from collections.abc import Iterator
from pathlib import Path

from motorcade.devices import DEVICES

LOCALES = Path(__file__).resolve().parent.parent / "src" / "motorcade" / "locales"
# For each kind of step, where its text is, and what the text is.
_STEP_TEXTS = (
    ("page.blocks", "the text of the block"),
    ("page.startBlocks", "the text of the block for beginners"),
    ("page.tooltips", "what the block does"),
    ("page.story", "the step in a word's story"),
)


def missing_texts() -> list[str]:
    """Return a sentence for each text that is missing in a language."""
    found = []
    for path in sorted(LOCALES.glob("*.json")):
        texts = json.loads(path.read_text(encoding="utf-8"))
        for section, key, about in _needed():
            held = texts
            for part in section.split("."):
                held = held.get(part, {})
            if key not in held:
                found.append(f"src/motorcade/locales/{path.name} lacks {section}.{key}: {about}")
    return found


def _needed() -> Iterator[tuple[str, str, str]]:
    for device in DEVICES:
        for step in device.steps:
            for section, about in _STEP_TEXTS:
                yield section, step.kind, about
            yield "phrases", f"step-{step.kind}", "the step in a sentence"
            if step.minds:
                yield "page.blocks.minds", step.kind, "what a drive says that can mind it"
                yield "phrases", f"why-minds-{step.minds}", "the answer of a car that minds it"
            if step.accompanies:
                yield "command_line", f"does-{step.kind}", "the step in the command line's table of words"
        for bits in device.bits:
            yield "page.fields", bits.name, "the field of a word"
            for word_format in ("control", "frame"):
                yield "meanings", f"{word_format}.{bits.name}", "the meaning of the field"
        if device.bits:
            yield "page.groups", device.group, "the part of a word"
        for part in device.parts:
            yield "phrases", f"device-{part.key}", "the name of the part"
