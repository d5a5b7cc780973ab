"""Reads a mat from its file, TOML or JSON with the same keys."""

import json
import tomllib
from pathlib import Path
from typing import Any, Literal

from motorcade.engine.errors import MatError
from motorcade.mats.document import mat_of
from motorcade.mats.model import Mat

_NOT_UTF_8 = {"en": "its text isn't UTF-8, or its name can't be", "zh": "文字不是 UTF-8，或文件名不能这样写"}
_KINDS: dict[str, Literal["toml", "json"]] = {".toml": "toml", ".json": "json"}


def read_mat(path: str | Path) -> Mat:
    """The mat in the file at ``path``, which ends in .toml or .json.

    Raises:
        MatError: it can't be read or isn't a mat; the sentence names the place and what to do.
    """
    path = Path(path)
    kind = _KINDS.get(path.suffix.lower())
    if kind is None:
        raise MatError("bad-ending", mat=path.name)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or _NOT_UTF_8
        raise MatError("unreadable", mat=path.name, reason=reason) from None
    return parse_mat(text, path.name, kind)


def parse_mat(text: str, name: str, kind: Literal["toml", "json"]) -> Mat:
    """The mat in ``text``; ``name`` is what errors call it. Raises MatError."""
    try:
        document = tomllib.loads(text) if kind == "toml" else json.loads(text, object_pairs_hook=_unique)
    except RecursionError:
        raise MatError("brackets", mat=name) from None
    except ValueError as error:
        raise MatError("syntax", mat=name, kind=kind.upper(), reason=error) from None
    if not isinstance(document, dict):
        raise MatError("no-object", mat=name)
    return mat_of(document, name)


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) < len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for key in keys if keys.count(key) > 1)
        raise ValueError(f"the key {twice[:40]!r} stands twice in one object")
    return table
