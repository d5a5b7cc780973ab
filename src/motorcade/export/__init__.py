"""Export the words, and the brain of a car, to other tools. A target makes the same bytes on every machine."""

from collections.abc import Callable, Mapping

from motorcade.config.vocabulary import MOTORCADE, Vocabulary
from motorcade.errors import MotorcadeError
from motorcade.export.brain_c import brain_c
from motorcade.export.c_header import c_header
from motorcade.export.markdown import markdown
from motorcade.export.schemas import json_schema, kaitai
from motorcade.export.vectors import vectors
from motorcade.export.wireshark import wireshark
from motorcade.locales import FIRST, languages

Target = Callable[[Vocabulary], dict[str, str]]


def _single(make: Callable[[Vocabulary], str], suffix: str) -> Target:
    return lambda vocabulary: {f"{vocabulary.file_stem}{suffix}": make(vocabulary)}


def _pages(vocabulary: Vocabulary) -> dict[str, str]:
    suffixes = {language: "" if language == FIRST else f".{language}" for language in languages()}
    return {f"{vocabulary.file_stem}{suffixes[language]}.md": markdown(vocabulary, language) for language in suffixes}


def _brain(vocabulary: Vocabulary) -> dict[str, str]:
    if vocabulary.file_stem != MOTORCADE.file_stem:
        raise MotorcadeError("brain-has-own-words", name=vocabulary.name)
    return brain_c()


TARGETS: Mapping[str, Target] = {
    "c": _single(c_header, ".h"),
    "brain-c": _brain,
    "wireshark": _single(wireshark, ".lua"),
    "kaitai": _single(kaitai, ".ksy"),
    "json-schema": _single(json_schema, ".schema.json"),
    "markdown": _pages,
    "vectors": _single(vectors, ".vectors.json"),
}


def export(target: str, vocabulary: Vocabulary) -> dict[str, str]:
    """Return the texts of the files of a target, by name. Raises MotorcadeError: unknown-target."""
    if target not in TARGETS:
        raise MotorcadeError("unknown-target", target=target[:40], targets=", ".join(TARGETS))
    return TARGETS[target](vocabulary)
