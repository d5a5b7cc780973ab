"""What stands above each answer of a class in a simulated lesson: its status, its headers and its cookies, whole."""

from typing import TYPE_CHECKING

from tests.faults import lesson_files
from tests.faults.browsers import DONE, Browser

from motorcade.errors import MotorcadeError

if TYPE_CHECKING:
    from tests.faults.lesson import Lesson

GUARDS = {
    "content-security-policy": "default-src 'self'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; media-src 'self' data: blob:; font-src 'self' data:; worker-src 'self' blob:; "
    "connect-src 'self' data: blob:; object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), geolocation=(), microphone=(), serial=(self)",
    "referrer-policy": "no-referrer",
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
}
_ANSWER = GUARDS | {"cache-control": "no-store", "content-type": "application/json"}
# What may stand there besides: of the length, and of the way that it is sent.
_FREE = {"date", "content-length", "transfer-encoding", "vary", "set-cookie"}
# Requests that give a browser a secret or take it away, and whose that is.
_KEEPS = {
    **dict.fromkeys(("class/join", "class/return"), "class"),
    **dict.fromkeys(("teacher/sign-in", "teacher/first-password"), "teacher"),
}
_FORGETS = {"class/leave": "class", "teacher/sign-out": "teacher"}
_KEPT = ["httponly", "max-age=31536000", "path=/", "samesite=strict"]


def check(run: "Lesson", browser: Browser, request: str, outcome: str) -> None:
    """Check the head of an answer to a request."""
    head = {name: value for name, value in browser.head.items() if name not in _FREE}
    other = {name: (head.get(name), _ANSWER.get(name)) for name in head.keys() ^ _ANSWER.keys() | _differing(head)}
    run.world.keep("guarded-pages", not other, "{} is answered with {}", request, other)
    status = 200 if outcome == DONE else MotorcadeError(outcome).http_status
    run.world.keep("says-why", browser.status == status, "{} ends in {}: {}", request, outcome, browser.status)
    _check_cookies(run, browser, request if outcome == DONE else "")


def check_page(run: "Lesson", browser: Browser, path: str) -> None:
    """Check the head of a page or its file: a browser asks again for it, unless its name changes with its content."""
    kept = "public, max-age=31536000, immutable" if path.startswith("/assets/") else "no-cache"
    known = GUARDS | {"cache-control": kept}
    other = {name: browser.head.get(name) for name, value in known.items() if browser.head.get(name) != value}
    run.world.keep("guarded-pages", not other, "{} comes with {}", path, other)


def _differing(head: dict[str, str]) -> set[str]:
    return {name for name, value in _ANSWER.items() if head.get(name) != value}


def _check_cookies(run: "Lesson", browser: Browser, done: str) -> None:
    """A browser is given one secret, which no script reads and no other site sends, where somebody comes in alone."""
    whose = _KEEPS.get(done) or _FORGETS.get(done)
    names = [f"motorcade_{whose}_{lesson_files.record(run)['id']}"] if whose else []
    found = [cookie.partition("=")[0] for cookie in browser.given]
    run.world.keep("no-secrets", found == names, "{!r} gives the cookies {}, not {}", done, found, names)
    for cookie in browser.given:
        check_cookie(run, cookie, ends=done in _FORGETS)


def check_cookie(run: "Lesson", cookie: str, is_secure: bool = False, ends: bool = False) -> None:
    """Check a cookie, whole; one that ``ends`` has no value."""
    value, *attributes = cookie.split("; ")
    told = sorted(attribute.lower() for attribute in attributes if not attribute.startswith("expires"))
    known = sorted([*_KEPT, *(["secure"] if is_secure else [])])
    if ends:
        known = ["max-age=0", "path=/", "samesite=lax"]
    run.world.keep("no-secrets", told == known, "a cookie has {}, not {}", told, known)
    secret = value.partition("=")[2].strip('"')
    is_new = not secret if ends else len(secret) >= 32 and secret not in run.secrets
    run.world.keep("no-secrets", is_new, "a cookie has {!r}", secret)
    run.secrets.add(secret)
