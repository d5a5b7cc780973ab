"""What is wrong with a mat or a world, in sentences; apart, so that naming these errors needs no NumPy."""

from typing import Any, ClassVar

from motorcade.sim import sentences


class _ToldError(ValueError):
    """An error with a sentence in each language.

    Attributes:
        code: a key of its kind's sentences; stable.
        figures: what fills the sentence's braces; a dict holds one text a language.
    """

    SENTENCES: ClassVar[dict[str, dict[str, str]]]

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


class MatError(_ToldError):
    """A mat that isn't there, can't be read or can't be.

    The figure ``mat`` is what the mat is called, where it has a name.
    """

    SENTENCES = sentences.MAT

    def message(self, language: str) -> str:
        """The whole sentence in ``language`` (en or zh), with the mat's name."""
        if "mat" not in self.figures:
            return self.reason(language)
        before = {"en": f"mat {self.figures['mat']}: ", "zh": f"场地 {self.figures['mat']}："}
        return before[language] + self.reason(language)


class WorldError(_ToldError):
    """A world that can't be: its cars, images or profile don't fit it, or the memory."""

    SENTENCES = sentences.WORLD
