"""Projects in the storage of a browser (`motorcade.service.library.Storage`).

IndexedDB answers later, while a storage answers at once. So this class works on an index in memory, and the page's
worker (`web/src/site/store.ts`) runs a request in these steps:

1. `load` the index, where this one isn't the newest.
2. Run the request.
3. If `wanted` says that it needs texts that aren't here, `supply` them and go to 2.
4. Store all `changes` in one transaction. If another tab has stored something since 1, go to 1; if the browser
   refuses, do 1 and answer with the reason.

So no other tab ever sees half of a change, and nothing is answered before it is stored.
"""

import time
from binascii import a2b_base64, b2a_base64
from collections.abc import Iterator
from hashlib import sha256
from typing import Any

import msgspec
from msgspec import Struct

from motorcade.errors import MotorcadeError
from motorcade.service.library import (
    DEFAULT_LIMITS,
    LONGEST_NAME,
    Limits,
    Storage,
    check_base,
    check_count,
    checked_name,
    iso_time,
    stars_in,
    united_stars,
)
from motorcade.service.messages import ErrorAnswer, LibraryEntry, StorageState, Version
from motorcade.words.image import parse_image_bytes
from motorcade.words.packing import ImageError

# The image of the virtual car, below this name.
_CAR = "virtual-car"
_STARS = "stars/"
_DIGEST_DIGITS = 16
_MOST_PROBLEMS = 10


class Record(Struct, array_like=True, frozen=True):
    """The key of a stored version; the text is its value.

    So the keys alone are the index: no text is read before somebody opens it, and one that is damaged hides no other.
    """

    owner: str
    name: str
    version: int
    saved_at_ms: int
    size_bytes: int
    digest: str


# The versions of each project by owner and name, the newest first.
_Projects = dict[tuple[str, str], tuple[Record, ...]]


class _Index(Struct):
    """What `load` takes: all keys and small values of the store.

    Attributes:
        revision: how many transactions have changed the store.
        keys: of all versions.
        values: stars by owner, and the virtual car's image.
        problem: why the browser's store couldn't be opened: missing, newer or damaged; empty where it could. Then
            nothing stays when the page is closed.
        most_bytes: how many bytes the browser lets this site store; None where it doesn't say.
    """

    revision: int
    keys: list[Any]
    values: dict[str, Any]
    problem: str = ""
    most_bytes: int | None = None


class _Changes(Struct, omit_defaults=True):
    """What is to be stored in one transaction.

    Attributes:
        revision: the revision of the index from which the changes were made.
        put: keys and texts.
        remove: keys.
        values: small values by name.
    """

    revision: int
    put: list[tuple[Record, str]] = []
    remove: list[Record] = []
    values: dict[str, Any] = {}


class _TextNeededError(MotorcadeError):
    """Ends a request that is run again once the text is here."""


class BrowserStorage(Storage):
    """The projects in a browser's store.

    Args:
        limits: how much an owner may store.
    """

    def __init__(self, limits: Limits = DEFAULT_LIMITS) -> None:
        self._limits = limits
        self._index = _Index(-1, [], {})
        self._stored: _Projects = {}
        self._projects: _Projects = {}
        self._problems: list[ErrorAnswer] = []
        self._texts: dict[Record, str | None] = {}
        self._wanted: list[Record] = []
        self._has_waited = False
        self._changes = _Changes(-1)
        self._car_image = ""

    @property
    def revision(self) -> int:
        """The revision of the index here; -1 before the first `load`."""
        return self._index.revision

    def load(self, index: str) -> None:
        """Take the newest index (JSON), and forget all changes and texts."""
        self._index = msgspec.json.decode(index, type=_Index)
        problem = self._index.problem
        unreadable = []
        found: dict[tuple[str, str], list[Record]] = {}
        for key in self._index.keys:
            try:
                record = msgspec.convert(key, Record)
                found.setdefault((record.owner, checked_name(record.name)), []).append(record)
            except (msgspec.ValidationError, MotorcadeError):
                name = key[1] if isinstance(key, list) and len(key) > 1 else key
                unreadable.append(MotorcadeError("damaged-record", name=str(name)[:LONGEST_NAME]))
        self._stored = {
            key: tuple(sorted(records, key=lambda record: record.version, reverse=True))
            for key, records in found.items()
        }
        problems = unreadable
        if problem:
            problems = [MotorcadeError(f"browser-store-{problem}"), *unreadable]
        self._problems = [ErrorAnswer(**problem.to_dict("page")) for problem in problems[:_MOST_PROBLEMS]]
        self._begin()

    def wanted(self) -> str:
        """Return the keys of the texts that the request needs, a JSON list; [] where it has been answered."""
        return msgspec.json.encode(self._wanted).decode()

    def supply(self, texts: str) -> None:
        """Take texts, a JSON list of pairs of a key and a text (null where it can't be read); forget the changes."""
        known = self._texts | dict(msgspec.json.decode(texts, type=list[tuple[Record, Any]]))
        self._begin()
        self._texts = known
        self._has_waited = True

    def changes(self) -> str:
        """Return what the request changes, as JSON; empty where it changes nothing."""
        made = self._changes
        if made.put or made.remove or made.values:
            return msgspec.json.encode(made).decode()
        return ""

    def settle(self, revision: int) -> None:
        """End a request: its changes are stored, and the store has ``revision`` now."""
        self._index.revision = revision
        self._index.values |= self._changes.values
        self._stored = self._projects
        self._begin()

    def _begin(self) -> None:
        """Forget the changes and texts of a request."""
        self._projects = dict(self._stored)
        self._texts = {}
        self._wanted = []
        self._has_waited = False
        self._changes = _Changes(self.revision)

    def write_version(
        self, owner: str, name: str, data: bytes, base: int | None = None, saved_at_s: float | None = None
    ) -> int:
        name = checked_name(name)
        records = self._projects.get((owner, name), ())
        digest = sha256(data).hexdigest()[:_DIGEST_DIGITS]
        newest = 0
        if records:
            newest = records[0].version
        if records and (records[0].digest, records[0].size_bytes) == (digest, len(data)):
            return newest
        check_base(name, base, newest)
        if not records:
            check_count(self._limits, len(self.list(owner)))
        most = self._limits.size_bytes
        if sum(record.size_bytes for record in self._of(owner)) + len(data) > most:
            raise MotorcadeError("browser-library-full", most=most / 1e6)
        changes = self._changes
        if saved_at_s is None:
            saved_at_s = time.time()
        record = Record(owner, name, newest + 1, int(saved_at_s * 1000), len(data), digest)
        self._texts[record] = text = data.decode()
        changes.put.append((record, text))
        all_records = (record, *records)
        self._projects[owner, name] = all_records[: self._limits.versions]
        changes.remove.extend(all_records[self._limits.versions :])
        return record.version

    def read(self, owner: str, name: str, version: int | None = None) -> bytes:
        records = self._existing(owner, name)
        found = [record for record in records if version in (None, record.version)]
        if not found:
            raise MotorcadeError("no-version", name=name, version=version)
        record = found[0]
        if record not in self._texts:
            # A request that needs a second text needs many: one for each run would take too long.
            several = [record for record in self._of(owner) if record not in self._texts]
            if self._has_waited:
                self._wanted = several
            else:
                self._wanted = [record]
            raise _TextNeededError("damaged-version", name=name)
        text = self._texts[record]
        if not isinstance(text, str) or sha256(text.encode()).hexdigest()[:_DIGEST_DIGITS] != record.digest:
            raise MotorcadeError("damaged-version", name=name)
        return text.encode()

    def history(self, owner: str, name: str) -> list[Version]:
        return [Version(record.version, _iso(record)) for record in self._existing(owner, name)]

    def delete(self, owner: str, name: str) -> None:
        """Remove a project with all its versions for good. Raises MotorcadeError."""
        self._changes.remove.extend(self._existing(owner, name))
        del self._projects[owner, checked_name(name)]

    def place(self) -> StorageState:
        return StorageState(not self._index.problem, self._problems)

    def stars(self, owner: str) -> dict[str, "list[int]"]:
        return stars_in((self._index.values | self._changes.values).get(_STARS + owner))

    def add_stars(self, owner: str, mission: str, stars: "list[int]") -> "list[int]":
        before = self.stars(owner)
        earned = united_stars(before, mission, stars)
        if earned != before.get(mission, []):
            self._changes.values[_STARS + owner] = before | {mission: earned}
        return earned

    def car_image(self) -> bytes | None:
        """The image that the virtual car holds; None where nothing was ever uploaded, or what is stored is damaged."""
        try:
            image = a2b_base64(self._index.values[_CAR], strict_mode=True)
            parse_image_bytes(image)
        except (KeyError, TypeError, ValueError, ImageError):
            return None
        return image

    def store_car_image(self, image: bytes) -> None:
        """Take a new image of the virtual car, for `take_car_image`."""
        self._car_image = self._index.values[_CAR] = b2a_base64(image, newline=False).decode()

    def take_car_image(self) -> str:
        """Return the new image as base64, to be stored at once: the last one counts, whichever tab sends it."""
        image = self._car_image
        self._car_image = ""
        return image

    def _existing(self, owner: str, name: str) -> tuple[Record, ...]:
        records = self._projects.get((owner, checked_name(name)))
        if not records:
            raise MotorcadeError("no-project", name=name)
        return records

    def _of(self, owner: str) -> Iterator[Record]:
        return (record for (whose, _), records in self._projects.items() if whose == owner for record in records)

    # The last method: below it `list` would be this one.
    def list(self, owner: str) -> list[LibraryEntry]:
        found = [
            LibraryEntry(name, _iso(records[0]), len(records))
            for (whose, name), records in self._projects.items()
            if whose == owner
        ]
        return sorted(found, key=lambda entry: (entry.saved_at, entry.name), reverse=True)


def _iso(record: Record) -> str:
    return iso_time(record.saved_at_ms / 1000)
