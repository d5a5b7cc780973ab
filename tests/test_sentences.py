"""What users are told, in English and Chinese: the same of each."""

import importlib
from string import Formatter

import pytest

from motorcade.errors import ToldError
from motorcade.program.diagnostics import LANGUAGES

# Where the errors are that are told in this way; those of mats and worlds have a test of their own.
HOMES = (
    "motorcade.config.pins",
    "motorcade.config.voice_map",
    "motorcade.drive.addresses",
    "motorcade.config.profile",
    "motorcade.server.studio.serving",
)
KINDS = [
    kind
    for home in HOMES
    for kind in vars(importlib.import_module(home)).values()
    if isinstance(kind, type) and issubclass(kind, ToldError) and kind is not ToldError
]


@pytest.mark.parametrize("kind", KINDS)
def test_both_languages_fill_in_the_same(kind: type[ToldError]) -> None:
    for code, sentences in kind.SENTENCES.items():
        assert set(sentences) == set(LANGUAGES), code
        english, chinese = (
            {name for _, name, _, _ in Formatter().parse(sentences[each]) if name} for each in LANGUAGES
        )
        assert english == chinese, code
