"""What is wrong with a mat or a world, in sentences; apart, so that naming these errors needs no NumPy."""

from motorcade.engine import sentences
from motorcade.errors import ToldError


class MatError(ToldError, ValueError):
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
