"""The exit code and the HTTP status of each error code, where they aren't the usual ones."""

from functools import cache

FINE = 0
# A program has errors, or doesn't reach a mission's goal.
PROGRAM_ERROR = 1
# A command can't do what it was asked for. So ends a command with any error that has no other exit code.
USAGE = 2
PORT_NOT_FOUND = 3
PORT_BUSY = 4
NO_ANSWER = 5
VERIFICATION = 6
PORT_FORBIDDEN = 7
REFUSED = 8
WENT_AWAY = 9
# By Ctrl-C: 128 and the number of the signal, as shells have it.
STOPPED = 130
# The status of all other errors.
BAD_REQUEST = 400

_Rows = tuple[tuple[int, tuple[str, ...]], ...]
EXIT_CODES: _Rows = (
    (PROGRAM_ERROR, ("program-errors",)),
    (PORT_NOT_FOUND, ("gpio-needs-linux", "no-gpio-chip", "another-computer", "watchdog-unusable")),
    (PORT_NOT_FOUND, ("battery-unreadable", "infrared-forbidden", "no-infrared-sender")),
    (PORT_NOT_FOUND, ("infrared-sender-fails", "camera-driver-missing", "no-camera", "no-picture")),
    (PORT_NOT_FOUND, ("camera-gives-no-answer", "too-many-viewers", "no-such-host", "no-car-there", "speaks-no-tls")),
    (PORT_NOT_FOUND, ("no-port-named", "not-a-port-name", "no-such-port", "no-car-found", "no-serial-port")),
    (
        PORT_NOT_FOUND,
        ("no-telemetry", "no-car-at-address", "no-car-at-port", "no-such-car", "no-cars-found", "port-fails"),
    ),
    (PORT_BUSY, ("cannot-listen", "port-busy", "car-busy")),
    (NO_ANSWER, ("no-micropython-answers", "no-answer", "takes-no-bytes", "nothing-to-read", "car-away")),
    (NO_ANSWER, ("no-answer-at-address", "runs-something-else")),
    (VERIFICATION, ("installed-file-differs", "not-trusted", "mismatch", "no-image")),
    (PORT_FORBIDDEN, ("gpio-forbidden", "port-forbidden")),
    (REFUSED, ("another-chip", "old-micropython", "board-has-no-room", "install-failed", "refuses", "keys-refused")),
    (REFUSED, ("another-drives", "is-stopped", "refused", "car-old-protocol", "car-keeps-no-name", "car-refuses")),
    (REFUSED, ("car-keys-refused", "car-takes-no-keys", "car-only-drives")),
    (WENT_AWAY, ("install-cut-off", "hung-up", "away", "takes-no-requests", "went-away", "says-nothing")),
    (WENT_AWAY, ("port-broke", "connection-broke")),
)
HTTP_STATUSES: _Rows = (
    (401, ("token-needed", "class-session-needed", "teacher-session-needed")),
    (403, ("foreign-host", "foreign-origin", "wrong-token", "wrong-class-code", "wrong-number", "wrong-password")),
    (403, ("wrong-first-key", "class-closed", "cable-of-another", "held-by-another", "not-your-turn")),
    (403, ("window-of-another", "window-is-free")),
    (404, ("no-mission", "no-such-pupil", "car-not-listed", "no-camera-here", "no-example")),
    (404, ("no-draft", "no-project", "no-version", "no-world", "not-found", "no-such-profile")),
    (409, ("no-such-host", "no-car-there", "speaks-no-tls", "hung-up", "away", "takes-no-requests", "not-trusted")),
    (409, ("refuses", "keys-refused", "another-drives", "is-stopped", "full", "enough-of-you", "no-program")),
    (409, ("not-yours", "no-such-connection", "not-a-request", "too-long", "nickname-taken", "nickname-reserved")),
    (409, ("class-full", "class-frozen", "mat-is-closed", "mat-is-full", "mat-is-empty", "too-many-handed-out")),
    (409, ("at-too-many-cars", "car-out-of-reach", "damaged-version", "not-at-car", "project-exists")),
    (409, ("no-telemetry", "says-nothing", "saved-elsewhere", "in-a-pair-already", "not-in-a-pair", "pair-went-on")),
    (413, ("body-too-large",)),
    (429, ("too-many-attempts", "gives-too-often", "requests-too-fast")),
    (500, ("browser-fault", "cant-delete", "cant-read", "cant-save", "class-not-stored", "undone-meanwhile")),
    (500, ("internal", "virtual-car", "work-not-collected")),
    (503, ("camera-driver-missing", "no-camera", "no-picture", "camera-gives-no-answer", "too-many-viewers")),
    (503, ("page-missing", "session-was-idle", "too-many-sessions", "too-many-sessions-of-one")),
    (507, ("browser-library-full", "browser-store-full", "library-full", "too-many-projects")),
)


@cache
def _by_code(rows: _Rows) -> dict[str, int]:
    return {code: outcome for outcome, codes in rows for code in codes}


def exit_code_of(code: str) -> int:
    """Return the exit code of a command that ends with the error ``code``."""
    return _by_code(EXIT_CODES).get(code, USAGE)


def http_status_of(code: str) -> int:
    """Return the HTTP status of a request that is answered by the error ``code``."""
    return _by_code(HTTP_STATUSES).get(code, BAD_REQUEST)
