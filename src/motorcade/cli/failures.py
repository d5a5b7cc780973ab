"""The errors that have not moved to the catalogue yet, and their exit codes."""

from motorcade.errors import MotorcadeError
from motorcade.outcomes import (
    USAGE,
)


class UsageError(Exception):
    """Something that the user typed and can't be."""


def exit_code(problem: Exception) -> int | None:
    """The exit code for an exception whose text is meant for the user; None for a fault of ours."""
    if isinstance(problem, MotorcadeError):
        return problem.exit_code
    codes = (
        (UsageError, USAGE),
        (OSError, USAGE),
    )
    return next((code for kind, code in codes if isinstance(problem, kind)), None)


def sentence(problem: Exception, language: str) -> str:
    """What is wrong, in ``language`` where it has a sentence for it."""
    if isinstance(problem, MotorcadeError):
        return problem.sentence(language)
    return str(problem)
