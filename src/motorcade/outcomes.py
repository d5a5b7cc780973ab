"""The exit code and the HTTP status of each error code, in one table."""

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

# Exit code, HTTP status, and the error codes that have them. Other errors have DEFAULT.
DEFAULT = (PROGRAM_ERROR, 400)
OUTCOMES: tuple[tuple[int, int, tuple[str, ...]], ...] = (
    (*DEFAULT, ()),
    (
        USAGE,
        400,
        (
            "extra-not-installed",
            "field-given-twice",
            "field-is-computed",
            "file-not-writable",
            "file-too-large",
            "folder-not-writable",
            "no-such-field",
            "not-32-bits",
            "not-a-whole-number",
            "not-host-and-port",
            "not-name-and-value",
            "output-is-input",
            "site-folder-in-use",
            "unknown-language",
            "unknown-target",
            "word-value",
        ),
    ),
    (USAGE, 400, ("option-not-allowed", "followers-with-mat", "profile-is-the-projects")),
    (USAGE, 400, ("run-file-ending", "run-file-is-folder", "run-file-without-folder", "run-file-forbidden")),
    (USAGE, 400, ("run-file-unwritable", "film-not-drawn", "gif-too-long", "nothing-recorded")),
    (USAGE, 400, ("not-a-recording", "recording-unreadable", "not-mcap", "mcap-cut-off", "mcap-without-run")),
    (USAGE, 400, ("file-not-usable", "picture-needs-options", "picture-needs-colour")),
    (USAGE, 400, ("picture-has-too-many-lines", "sweep-not-valid", "sweep-program-unreadable", "sweep-mat-not-valid")),
    (USAGE, 400, ("seconds-not-in-ticks", "sweep-point-fails", "not-a-sweep-table", "sweep-file-damaged")),
    (USAGE, 400, ("table-of-another-sweep", "sweep-is-running", "sweep-worker-ended", "worker-has-other-code")),
    (USAGE, 400, ("no-dask-scheduler", "dask-workers-killed", "dask-scheduler-gone", "dask-without-workers")),
    (USAGE, 400, ("class-damaged", "class-of-another-kind", "class-is-running")),
    # Missions.
    (USAGE, 400, ("mission-not-valid", "mission-program-not-valid")),
    (USAGE, 404, ("no-mission",)),
    # Real cars, and boards with MicroPython.
    (USAGE, 400, ("pins-missing", "options-exclude-each-other", "voice-map-missing", "chip-missing")),
    (USAGE, 400, ("store-unreadable", "store-holds-no-image")),
    (
        PORT_NOT_FOUND,
        400,
        ("gpio-needs-linux", "no-gpio-chip", "another-computer", "watchdog-unusable", "battery-unreadable"),
    ),
    (PORT_NOT_FOUND, 400, ("infrared-needs-linux", "infrared-forbidden", "no-infrared-sender")),
    (PORT_NOT_FOUND, 400, ("infrared-sender-fails",)),
    (PORT_BUSY, 400, ("cannot-listen", "no-pseudo-terminals")),
    (NO_ANSWER, 400, ("no-micropython-answers",)),
    (VERIFICATION, 400, ("installed-file-differs",)),
    (PORT_FORBIDDEN, 400, ("gpio-forbidden",)),
    (REFUSED, 400, ("another-chip", "old-micropython", "board-has-no-room", "install-failed")),
    (WENT_AWAY, 400, ("install-cut-off",)),
    # Keys and addresses of cars.
    (USAGE, 400, ("no-local-address", "port-taken", "address-unusable", "studio-port-taken", "not-a-camera-address")),
    (USAGE, 400, ("not-a-keys-name", "keys-named-twice", "keys-exist", "not-a-car-address", "authority-unreadable")),
    (USAGE, 400, ("authority-key-kind", "keys-of-wrong-role", "not-a-keys-file", "keys-locked", "keys-unreadable")),
    (USAGE, 400, ("keys-without-authority", "authority-certificate-unreadable", "camera-of-car")),
    (USAGE, 400, ("address-without-keys", "page-without-https", "uploads-in-reach", "pins-and-board")),
    (USAGE, 400, ("options-of-simulated-cars", "no-keys-to-revoke", "revoked-keys-unreadable", "revoked-without-keys")),
    (USAGE, 400, ("log-not-writable", "log-not-written", "bad-user-name")),
    (USAGE, 400, ("options-of-real-cars", "nobody-named", "not-a-car", "car-name-without-keys")),
    (USAGE, 400, ("not-part-of-a-command", "keyboard-needs-terminal", "cars-of-one-name", "camera-without-car")),
    (USAGE, 400, ("not-a-car-name", "not-a-telemetry-port", "not-name-and-host", "not-name-and-url")),
    # Sticks and cameras.
    (PORT_NOT_FOUND, 503, ("camera-driver-missing", "no-camera", "no-picture", "camera-gives-no-answer")),
    (PORT_NOT_FOUND, 503, ("too-many-viewers",)),
    # A driver and a car over a network.
    (PORT_NOT_FOUND, 409, ("no-such-host", "no-car-there", "speaks-no-tls")),
    (WENT_AWAY, 409, ("hung-up", "away", "takes-no-requests")),
    (VERIFICATION, 409, ("not-trusted",)),
    (REFUSED, 409, ("refuses", "keys-refused", "another-drives", "is-stopped")),
    (PROGRAM_ERROR, 409, ("full", "enough-of-you", "no-program", "not-yours", "no-such-connection", "not-a-request")),
    (PROGRAM_ERROR, 409, ("too-long",)),
    # Uploads.
    (USAGE, 400, ("several-ports",)),
    (PORT_NOT_FOUND, 400, ("no-port-named", "not-a-port-name", "no-such-port", "no-car-found", "no-serial-port")),
    (PORT_NOT_FOUND, 400, ("no-car-at-address",)),
    (PORT_BUSY, 400, ("port-busy", "car-busy")),
    (NO_ANSWER, 400, ("no-answer", "takes-no-bytes", "nothing-to-read")),
    (VERIFICATION, 400, ("mismatch", "no-image")),
    (PORT_FORBIDDEN, 400, ("port-forbidden",)),
    (REFUSED, 400, ("refused",)),
    (WENT_AWAY, 400, ("went-away",)),
    (PROGRAM_ERROR, 401, ("token-needed", "class-session-needed", "teacher-session-needed")),
    (PROGRAM_ERROR, 403, ("foreign-host", "foreign-origin", "wrong-token")),
    # A class.
    (
        PROGRAM_ERROR,
        403,
        (
            *("wrong-class-code", "wrong-number", "wrong-password", "wrong-first-key"),
            *("class-closed", "cable-of-another", "held-by-another", "not-your-turn"),
        ),
    ),
    (PROGRAM_ERROR, 404, ("no-such-pupil",)),
    (
        PROGRAM_ERROR,
        409,
        (
            "nickname-taken",
            "nickname-reserved",
            "class-full",
            "class-frozen",
            "mat-is-closed",
            "mat-is-full",
            "mat-is-empty",
            "too-many-handed-out",
        ),
    ),
    (PROGRAM_ERROR, 429, ("too-many-attempts", "gives-too-often")),
    (
        PROGRAM_ERROR,
        404,
        (
            "car-not-listed",
            "no-camera-here",
            "no-example",
            "no-own-mission",
            "no-project",
            "no-version",
            "no-world",
            "not-found",
            "unknown-profile",
        ),
    ),
    (
        PROGRAM_ERROR,
        409,
        (
            "at-too-many-cars",
            "car-out-of-reach",
            "damaged-version",
            "not-at-car",
            "project-exists",
            "saved-elsewhere",
        ),
    ),
    (PROGRAM_ERROR, 413, ("body-too-large",)),
    (PROGRAM_ERROR, 429, ("requests-too-fast",)),
    (
        PROGRAM_ERROR,
        500,
        (
            "browser-fault",
            "cant-delete",
            "cant-read",
            "cant-save",
            "class-not-stored",
            "undone-meanwhile",
            "internal",
            "virtual-car",
        ),
    ),
    (USAGE, 503, ("page-missing",)),
    (PROGRAM_ERROR, 503, ("session-was-idle", "too-many-sessions", "too-many-sessions-of-one")),
    (PROGRAM_ERROR, 507, ("browser-library-full", "browser-store-full", "library-full", "too-many-projects")),
)


@cache
def _by_code() -> dict[str, tuple[int, int]]:
    return {code: (exit_code, status) for exit_code, status, codes in OUTCOMES for code in codes}


def exit_code_of(code: str) -> int:
    """Return the exit code of a command that ends with the error ``code``."""
    return _by_code().get(code, DEFAULT)[0]


def http_status_of(code: str) -> int:
    """Return the HTTP status of a request that is answered by the error ``code``."""
    return _by_code().get(code, DEFAULT)[1]
