"""What can be exported: each target makes files, named, from a vocabulary."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from motorcade.errors import MotorcadeError
from motorcade.export.c_header import c_header
from motorcade.export.json_schema import json_schema
from motorcade.export.kaitai import kaitai
from motorcade.export.markdown import markdown
from motorcade.export.vectors import vectors
from motorcade.export.vocabulary import Vocabulary
from motorcade.export.wireshark import wireshark


class Target(NamedTuple):
    """One target: what it is for, in a phrase, and its files' texts by name."""

    purpose: str
    files: Callable[[Vocabulary], dict[str, str]]


def _single(make: Callable[[Vocabulary], str], suffix: str) -> Callable[[Vocabulary], dict[str, str]]:
    return lambda vocabulary: {f"{vocabulary.file_stem}{suffix}": make(vocabulary)}


def _pages(vocabulary: Vocabulary) -> dict[str, str]:
    return {
        f"{vocabulary.file_stem}{'' if language == 'en' else f'.{language}'}.md": markdown(vocabulary, language)
        for language in ("en", "zh")
    }


TARGETS: Mapping[str, Target] = {
    "c": Target("a C99 header for AVR and desktop", _single(c_header, ".h")),
    "wireshark": Target("a Wireshark dissector in Lua", _single(wireshark, ".lua")),
    "kaitai": Target("a Kaitai Struct description", _single(kaitai, ".ksy")),
    "json-schema": Target("a JSON Schema of decoded words", _single(json_schema, ".schema.json")),
    "markdown": Target("pages with bit diagrams, in English and Chinese", _pages),
    "vectors": Target("golden vectors as JSON", _single(vectors, ".vectors.json")),
}


def export(target: str, vocabulary: Vocabulary) -> dict[str, str]:
    """The texts of a target's files, by name. Raises MotorcadeError: unknown-target."""
    if target not in TARGETS:
        raise MotorcadeError("unknown-target", target=target[:40], targets=", ".join(TARGETS))
    return TARGETS[target].files(vocabulary)
