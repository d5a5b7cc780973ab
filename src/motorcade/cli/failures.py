"""The errors that have not moved to the catalogue yet, and their exit codes."""

from motorcade.errors import MotorcadeError
from motorcade.outcomes import (
    NO_ANSWER,
    PORT_BUSY,
    PORT_FORBIDDEN,
    PORT_NOT_FOUND,
    PROGRAM_ERROR,
    REFUSED,
    USAGE,
    VERIFICATION,
    WENT_AWAY,
)


class UsageError(Exception):
    """Something that the user typed and can't be."""


def exit_code(problem: Exception) -> int | None:
    """The exit code for an exception whose text is meant for the user; None for a fault of ours."""
    if isinstance(problem, MotorcadeError):
        return problem.exit_code
    from motorcade.cameras.camera_failures import CameraError
    from motorcade.drive.car_failures import CarAwayError, CarNotFoundError, CarNotTrustedError, CarRefusesError
    from motorcade.drive.input.stick_failures import StickError
    from motorcade.drive.tls.keys import KeysError
    from motorcade.program.decompiler import DecompileError
    from motorcade.program.diagnostics import ProgramError
    from motorcade.upload.failures import (
        NoAnswerError,
        PortBusyError,
        PortForbiddenError,
        PortNotFoundError,
        RefusedError,
        SeveralPortsError,
        VerificationError,
        WentAwayError,
    )

    codes = (
        (ProgramError, PROGRAM_ERROR),
        (DecompileError, PROGRAM_ERROR),
        (UsageError, USAGE),
        (CameraError, PORT_NOT_FOUND),
        (StickError, PORT_NOT_FOUND),
        (OSError, USAGE),
        (PortNotFoundError, PORT_NOT_FOUND),
        (PortBusyError, PORT_BUSY),
        (NoAnswerError, NO_ANSWER),
        (VerificationError, VERIFICATION),
        (PortForbiddenError, PORT_FORBIDDEN),
        (RefusedError, REFUSED),
        (WentAwayError, WENT_AWAY),
        (CarNotFoundError, PORT_NOT_FOUND),
        (CarAwayError, WENT_AWAY),
        (CarNotTrustedError, VERIFICATION),
        (CarRefusesError, REFUSED),
        (KeysError, USAGE),
        (SeveralPortsError, USAGE),
    )
    return next((code for kind, code in codes if isinstance(problem, kind)), None)


def sentence(problem: Exception, language: str) -> str:
    """What is wrong, in ``language`` where it has a sentence for it."""
    from motorcade.cameras.camera_failures import CameraError
    from motorcade.drive.car_failures import CarError
    from motorcade.drive.input.stick_failures import StickError
    from motorcade.errors import ToldError
    from motorcade.program.decompiler import DecompileError
    from motorcade.upload.failures import PortError

    if isinstance(problem, MotorcadeError):
        return problem.sentence(language)
    if isinstance(problem, ToldError | PortError | CarError | CameraError | StickError | DecompileError):
        return problem.message(language)
    return str(problem)
