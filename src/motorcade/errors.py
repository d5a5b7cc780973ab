"""The error that every part raises, and the parts of sentences: a code or key, and the details that fill its sentence.

Portable: a microcontroller carries this file without the sentences, which are in `motorcade.locales`, and without the
exit codes and HTTP statuses, which are in `motorcade.outcomes`.
"""

# For the type checker alone: MicroPython has no such module.
MYPY = False
if MYPY:
    from typing import Any


class Phrase:
    """Part of a sentence that differs by language, as a detail of an error or a diagnostic.

    Args:
        key: its key below "phrases" in `locales/<language>.json`.
        details: fill its braces.
    """

    def __init__(self, key: str, **details: "Any") -> None:
        self.key = key
        self.details = details

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Phrase) and (self.key, self.details) == (other.key, other.details)

    def __hash__(self) -> int:
        return hash(self.key)

    def __str__(self) -> str:
        return self.sentence()

    def __repr__(self) -> str:
        return repr(self.sentence())

    def sentence(self, language: str = "en") -> str:
        """The phrase in ``language``; key and details where no sentences are installed."""
        try:
            from motorcade.locales import text
        except ImportError:
            return self.brief()
        return text("phrases", self.key, self.details, language)

    def brief(self) -> str:
        """The key and the plain details, the same on every target: ``values-from-to maximum=180 minimum=0``."""
        return brief(self.key, self.details)


class MotorcadeError(Exception):
    """Something is wrong that a user can act on.

    Callers may catch a part of the tree below, and `WordError`, `ImageError`, `ProgramError` of the modules that raise
    them. Each code is raised as one class. A module has a subclass where its callers have to distinguish one.

    Attributes:
        code: names the sentence: the key below "errors" in `locales/<language>.json`; stable.
        details: fill the sentence's braces, by name. A detail that has a ``sentence`` of its own (another error, a
            Phrase) is told in the same language, and so is what the system refused (OSError).
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
            return self.brief()
        return error_sentence(self.code, self.details, language, audience)

    def brief(self) -> str:
        """The code and the plain details, the same on every target: ``image-word position=3 word=0x40000001``."""
        return brief(self.code, self.details)

    def to_dict(self, audience: str = "") -> "dict[str, Any]":
        """``{"code", "details", "sentence": {language: text}}``, for JSON."""
        from motorcade.locales import languages

        details = {
            # What the system refused, without the names of this computer's files.
            name: value if isinstance(value, (int, float)) else str(getattr(value, "strerror", None) or value)
            for name, value in self.details.items()
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


class InputError(MotorcadeError):
    """A file that somebody wrote, or a value that was given, isn't allowed."""


class MatError(InputError):
    """A mat, or what stands on it, isn't allowed."""


class TransferError(MotorcadeError):
    """An image or a request doesn't get to a car, or the car doesn't take it."""


class DriveError(MotorcadeError):
    """Something fails between a driver and a car."""


class CameraError(MotorcadeError):
    """A camera gives no pictures."""


def brief(code: str, details: "dict[str, Any]") -> str:
    """``code`` and, sorted by name, those ``details`` that have no sentence of their own; words in hexadecimal."""
    parts = [code]
    for name in sorted(details):
        value = details[name]
        if not hasattr(value, "sentence"):
            parts.append(("{}=0x{:08X}" if name in ("header", "word") else "{}={}").format(name, value))
    return " ".join(parts)
