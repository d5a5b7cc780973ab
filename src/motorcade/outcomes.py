"""What an error's code means to a shell and to HTTP: one table."""

from functools import cache

FINE = 0
PROGRAM_ERROR = 1
USAGE = 2
PORT_NOT_FOUND = 3
PORT_BUSY = 4
NO_ANSWER = 5
VERIFICATION = 6
PORT_FORBIDDEN = 7
REFUSED = 8
WENT_AWAY = 9

# Exit code, HTTP status, and the error codes that have them; an error that isn't here has the first line's.
DEFAULT = (PROGRAM_ERROR, 400)
OUTCOMES: tuple[tuple[int, int, tuple[str, ...]], ...] = (
    (*DEFAULT, ()),
    (
        USAGE,
        400,
        (
            "field-given-twice",
            "file-not-writable",
            "file-too-large",
            "folder-not-writable",
            "format-not-utf-8",
            "no-such-field",
            "not-32-bits",
            "not-a-whole-number",
            "not-name-and-value",
            "output-is-input",
            "unknown-language",
            "unknown-target",
            "word-value",
        ),
    ),
    (USAGE, 400, ("option-not-allowed", "followers-with-mat")),
    (USAGE, 400, ("run-file-ending", "run-file-is-folder", "run-file-without-folder", "run-file-forbidden")),
    (USAGE, 400, ("run-file-unwritable", "film-not-drawn", "gif-too-long", "nothing-recorded")),
    (USAGE, 400, ("not-a-recording", "recording-unreadable", "not-mcap", "mcap-cut-off", "mcap-without-run")),
    (USAGE, 400, ("not-parquet", "parquet-damaged", "parquet-without-run", "parquet-of-part")),
    # Real cars, and boards with MicroPython.
    (USAGE, 400, ("pins-missing", "options-exclude-each-other", "voice-map-missing", "chip-missing")),
    (USAGE, 400, ("store-unreadable", "store-holds-no-image")),
    (PORT_NOT_FOUND, 400, ("gpio-needs-linux", "no-gpio-chip", "another-computer", "watchdog-unusable")),
    (PORT_NOT_FOUND, 400, ("infrared-needs-linux", "infrared-forbidden", "no-infrared-sender")),
    (PORT_NOT_FOUND, 400, ("infrared-sender-fails",)),
    (PORT_BUSY, 400, ("cannot-listen", "no-pseudo-terminals")),
    (NO_ANSWER, 400, ("no-micropython-answers",)),
    (VERIFICATION, 400, ("installed-file-differs",)),
    (PORT_FORBIDDEN, 400, ("gpio-forbidden",)),
    (REFUSED, 400, ("another-chip", "old-micropython", "board-has-no-room", "install-failed")),
    (WENT_AWAY, 400, ("install-cut-off",)),
)


@cache
def _by_code() -> dict[str, tuple[int, int]]:
    return {code: (exit_code, status) for exit_code, status, codes in OUTCOMES for code in codes}


def exit_code_of(code: str) -> int:
    """The exit code of a command that ends with the error ``code``."""
    return _by_code().get(code, DEFAULT)[0]


def http_status_of(code: str) -> int:
    """The HTTP status of a request that is answered by the error ``code``."""
    return _by_code().get(code, DEFAULT)[1]
