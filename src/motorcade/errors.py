"""Errors that can be told in English and in Chinese."""

from typing import Any, ClassVar

Sentences = dict[str, dict[str, str]]


class ToldError(Exception):
    """An error with a sentence in each language.

    Attributes:
        SENTENCES: the sentences of its kind, by code and language; the words in braces are filled in per case.
        code: a key of these; stable.
        figures: what fills the braces; a dict holds one text a language.
    """

    SENTENCES: ClassVar[Sentences]

    def __init__(self, code: str, **figures: Any):
        self.code = code
        self.figures = figures
        super().__init__(self.message("en"))

    def reason(self, language: str) -> str:
        """The sentence in ``language`` (en or zh), without what it is about."""
        figures = {name: value[language] if isinstance(value, dict) else value for name, value in self.figures.items()}
        return self.SENTENCES[self.code][language].format(**figures)

    def message(self, language: str) -> str:
        """The whole sentence in ``language`` (en or zh)."""
        return self.reason(language)
