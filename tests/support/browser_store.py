"""A mock of the browser's store behind BrowserStorage, and the steps of `web/src/site/store.ts` in Python."""

import json
from collections.abc import Callable
from typing import Any, TypeVar

import pytest

from motorcade.browser.storage import BrowserStorage
from motorcade.errors import MotorcadeError
from motorcade.service.library import DEFAULT_LIMITS, Limits

T = TypeVar("T")


def save(storage: Any, name: str, text: str, **options: Any) -> Any:
    """Store a version of a project; return its number."""
    return storage.write_version("", name, text.encode(), **options)


def refusal(call: Callable[..., object], *arguments: Any, **options: Any) -> str:
    """The code with which a call is refused."""
    with pytest.raises(MotorcadeError) as refused:
        call(*arguments, **options)
    return refused.value.code


class MockStore:
    """What a browser's IndexedDB holds; all tabs of a site share it.

    Attributes:
        refuses: the error's code with which it refuses every change; empty for none.
        before_commit: called once before the next commit: what another tab does meanwhile.
        commits: how many changes were stored.
    """

    def __init__(self) -> None:
        self.revision = 0
        self.texts: dict[tuple[Any, ...], Any] = {}
        self.values: dict[str, Any] = {}
        self.problem = ""
        self.refuses = ""
        self.before_commit: Callable[[], object] | None = None
        self.commits = 0

    def index(self) -> str:
        return json.dumps(
            {"revision": self.revision, "keys": list(self.texts), "values": self.values, "problem": self.problem}
        )

    def texts_of(self, keys: str) -> str:
        return json.dumps([[key, self.texts.get(tuple(key))] for key in json.loads(keys)])

    def commit(self, changes: str) -> bool:
        """Store the changes; False where they were made from an older revision."""
        meanwhile, self.before_commit = self.before_commit, None
        if meanwhile:
            meanwhile()
        made = json.loads(changes)
        if made["revision"] != self.revision:
            return False
        for key in made.get("remove", []):
            del self.texts[tuple(key)]
        self.texts |= {tuple(key): text for key, text in made.get("put", [])}
        self.values |= made.get("values", {})
        self.revision += 1
        self.commits += 1
        return True

    def keep_car(self, image: str) -> None:
        """Store the image of the virtual car."""
        self.values["virtual-car"] = image
        self.revision += 1


class MockTab:
    """One tab: a BrowserStorage over the store. It has the methods of a Storage, each run as one request."""

    def __init__(self, store: MockStore, limits: Limits = DEFAULT_LIMITS) -> None:
        self.store = store
        self.storage = BrowserStorage(limits)
        self.runs = 0

    def run(self, request: Callable[[BrowserStorage], T]) -> T:
        """Answer a request as the worker does: its answer is given once it is stored."""
        storage, store = self.storage, self.store
        while True:
            if storage.revision != store.revision:
                storage.load(store.index())
            result = self._answered(request)
            changes = storage.changes()
            if not changes or (not store.refuses and store.commit(changes)):
                storage.settle(store.revision)
                break
            storage.load(store.index())
            if store.refuses:
                raise MotorcadeError(f"browser-store-{store.refuses}")
        if isinstance(result, MotorcadeError):
            raise result
        return result

    def _answered(self, request: Callable[[BrowserStorage], T]) -> T | MotorcadeError:
        while True:
            self.runs += 1
            try:
                result: T | MotorcadeError = request(self.storage)
            except MotorcadeError as problem:
                result = problem
            wanted = self.storage.wanted()
            if wanted == "[]":
                return result
            self.storage.supply(self.store.texts_of(wanted))

    def __getattr__(self, name: str) -> Any:
        return lambda *arguments, **options: self.run(lambda storage: getattr(storage, name)(*arguments, **options))
