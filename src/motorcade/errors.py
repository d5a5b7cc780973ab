"""The error that every part raises: a code and the details that fill its sentence.

Portable: a microcontroller carries this file without the sentences, which are in `motorcade.locales`, and without the
exit codes and HTTP statuses, which are in `motorcade.outcomes`.
"""

# For the type checker alone: MicroPython has no such module.
MYPY = False
if MYPY:
    from typing import Any


class MotorcadeError(Exception):
    """Something is wrong that a user can act on.

    A subclass exists only where a caller has to distinguish it.

    Attributes:
        code: names the sentence: the key below "errors" in `locales/<language>.json`; stable.
        details: fill the sentence's braces, by name. A detail that has a ``sentence`` of its own (another error, a
            `motorcade.locales.Phrase`) is told in the same language.
    """

    def __init__(self, code: str, **details: "Any") -> None:
        super().__init__(code)
        self.code = code
        self.details = details

    def __str__(self) -> str:
        return self.sentence()

    def sentence(self, language: str = "en", audience: str = "") -> str:
        """The sentence in ``language``; code and details where no sentences are installed.

        Args:
            language: one of `motorcade.locales.languages()`; English where that language has no such sentence.
            audience: ``"page"`` for a sentence that doesn't speak of the command line, where there is one.
        """
        try:
            from motorcade.locales import error_sentence
        except ImportError:
            return " ".join([self.code] + ["{}={}".format(name, self.details[name]) for name in self.details])
        return error_sentence(self.code, self.details, language, audience)

    def to_dict(self, audience: str = "") -> "dict[str, Any]":
        """``{"code", "details", "sentence": {language: text}}``, for JSON."""
        from motorcade.locales import languages

        details = {
            name: value if isinstance(value, (int, float)) else str(value) for name, value in self.details.items()
        }
        sentence = {language: self.sentence(language, audience) for language in languages()}
        return {"code": self.code, "details": details, "sentence": sentence}

    @property
    def exit_code(self) -> int:
        """The exit code of a command that this error ends, by `motorcade.outcomes`."""
        from motorcade.outcomes import exit_code_of

        return exit_code_of(self.code)

    @property
    def http_status(self) -> int:
        """The HTTP status of a request that this error answers, by `motorcade.outcomes`."""
        from motorcade.outcomes import http_status_of

        return http_status_of(self.code)


class ToldError(Exception):
    """The errors that have not moved to the catalogue yet."""

    SENTENCES: "dict[str, dict[str, str]]"

    def __init__(self, code: str, **figures: "Any"):
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


if MYPY:  # noqa: SIM108
    Sentences = dict[str, dict[str, str]]
else:
    Sentences = dict
