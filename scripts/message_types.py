"""Write messages as TypeScript: the texts of messages.ts, remote.ts and classroom.ts in web/src/generated/."""

import inspect
import json
from collections.abc import Collection, Mapping
from typing import Any, get_args

from msgspec import NODEFAULT
from msgspec import inspect as types
from scripts.typescript import interface

from motorcade.classroom import messages as class_messages
from motorcade.classroom.app import REQUESTS as CLASS_REQUESTS
from motorcade.classroom.folder import MOST_FILES
from motorcade.server import remote_messages
from motorcade.service import messages, trials, world_messages
from motorcade.service.library import MOST_BYTES
from motorcade.service.requests import REQUESTS

# What the pages of a class are sent.
_CLASS_ANSWERS = {
    "ClassAnswer": class_messages.PupilView | class_messages.Goodbye | world_messages.Refused,
    "TeacherAnswer": class_messages.ClassView | class_messages.Goodbye | world_messages.Refused,
    "WallAnswer": class_messages.ClassWall | world_messages.Refused,
}

_HEAD = """/** Messages between the page and its service. Written by scripts/generate.py; don't edit. */

/** A language's tag, such as en or zh. */
export type Language = string;

/** A text in every language that the service has. */
export interface Sentence {
  en: string;
  [language: Language]: string | undefined;
}

/** Blockly's `serialization.workspaces` state; the page reads it through Blockly alone. */
export type WorkspaceState = Record<string, unknown>;

/** A motorcade-mat/1 document. */
export interface MatDocument {
  format: "motorcade-mat/1";
  name: string;
  [key: string]: unknown;
}
"""
_REMOTE_HEAD = """/** Messages between the remote's page and the server. Written by scripts/generate.py; don't edit. */

import type { Sentence } from "./messages";
"""
_CLASS_HEAD = """/** Messages of a class's pages and the server. Written by scripts/generate.py; don't edit. */

import type { {names} } from "./messages";

/** How many files are checked for one report, and how many bytes they have at most. */
export const MOST_FILES = {files};
export const MOST_BYTES = {bytes};
"""
_PLAIN = {
    types.StrType: "string",
    types.BytesType: "string",
    types.IntType: "number",
    types.FloatType: "number",
    types.BoolType: "boolean",
    types.NoneType: "null",
    types.AnyType: "unknown",
}
# What no page reads of a profile.
_UNREAD = {
    "ProfileFigures": {
        *("idle_state_ms", "lacks", "infrared", "serial", "body", "floor", "servo", "motor", "wheels", "drive")
    }
}
_UNIONS = {
    **dict.fromkeys(("WorldMessage", "WorldAnswer", "Outcome", "UploadAnswer", "CarsAnswer"), world_messages),
    **dict.fromkeys(("TrialMessage", "TrialAnswer"), trials),
}


class _Writer:
    """Translate types, and collect the interfaces that they need in ``interfaces``, by name.

    Args:
        elsewhere: the interfaces that another file has; those of them that are needed come into ``imported``.
    """

    def __init__(self, elsewhere: Collection[str] = ()) -> None:
        self.interfaces: dict[str, str] = {}
        self.imported: set[str] = set()
        self._elsewhere = elsewhere

    def type_of(self, kind: types.Type) -> str:
        """Return the TypeScript type of ``kind``."""
        if plain := _PLAIN.get(type(kind)):
            return plain
        if isinstance(kind, types.Metadata):
            return (kind.extra_json_schema or {}).get("title") or self.type_of(kind.type)
        if isinstance(kind, types.UnionType):
            return " | ".join(self.type_of(each) for each in kind.types)
        if isinstance(kind, types.LiteralType):
            return " | ".join(json.dumps(each) for each in kind.values)
        if isinstance(kind, types.ListType | types.VarTupleType):
            item = self.type_of(kind.item_type)
            return f"({item})[]" if " | " in item else f"{item}[]"
        if isinstance(kind, types.DictType):
            return f"Record<string, {self.type_of(kind.value_type)}>"
        if isinstance(kind, types.StructType | types.DataclassType):
            return self._interface(kind)
        raise TypeError(f"no TypeScript for {kind}")

    def union(self, name: str, members: Any) -> str:
        """Return the declaration of a union of messages; their interfaces are written before."""
        return (
            f"export type {name} = {' | '.join(self.type_of(types.type_info(each)) for each in get_args(members))};\n"
        )

    def _interface(self, kind: types.StructType | types.DataclassType) -> str:
        name = kind.cls.__name__
        if name in self._elsewhere:
            self.imported.add(name)
            return name
        if name.startswith("_"):
            # The message of a request of a class: the parameters of a method.
            fields = "; ".join(self._field(kind.cls, each) for each in kind.fields)
            return f"{{ {fields} }}" if fields else self.type_of(types.type_info(messages.Nothing))
        if name not in self.interfaces:
            self.interfaces[name] = ""
            if not kind.fields and not getattr(kind, "tag_field", None):
                self.interfaces[name] = f"/** {_summary(kind.cls)} */\nexport type {name} = Record<string, never>;\n"
                return name
            listed = [self._field(kind.cls, each) for each in kind.fields if each.name not in _UNREAD.get(name, ())]
            if isinstance(kind, types.StructType) and kind.tag_field:
                listed.insert(0, f'{kind.tag_field}: "{kind.tag}"')
            self.interfaces[name] = f"/** {_summary(kind.cls)} */\n{interface(name, listed)}"
        return name

    def _field(self, cls: type, field: types.Field) -> str:
        return f"{field.encode_name}{'?' if _is_optional(cls, field) else ''}: {self.type_of(field.type)}"


def _is_optional(cls: type, field: types.Field) -> bool:
    """Return whether a message may lack the field.

    The page may omit fields that have a default; the service omits fields that hold their default.
    """
    config = getattr(cls, "__struct_config__", None)
    if config is None or field.required:
        return False
    if field.default is NODEFAULT and field.default_factory is NODEFAULT:
        # The default is UNSET, which is not written.
        return True
    is_from_page = config.forbid_unknown_fields or cls in {request.message for request in REQUESTS.values()}
    is_answer = cls in {request.answer for request in REQUESTS.values()}
    return bool(config.omit_defaults or (is_from_page and not is_answer))


def _summary(cls: type) -> str:
    return (inspect.getdoc(cls) or "").partition("\n")[0]


def message_types() -> str:
    """Return the text of messages.ts."""
    writer, table = _service_types()
    unions = [writer.union(name, getattr(module, name)) for name, module in _UNIONS.items()]
    return "\n".join([_HEAD, *writer.interfaces.values(), *unions, table])


def _service_types() -> tuple[_Writer, str]:
    """Return the interfaces of the service, and the table of its requests."""
    writer = _Writer()
    what = "Every request: `POST /api/<name>` with its message gives its answer."
    table = _table(writer, "Requests", what, {name: request[:2] for name, request in REQUESTS.items()})
    writer.type_of(types.type_info(messages.ErrorAnswer))
    writer.type_of(types.type_info(world_messages.CarsOrder))
    return writer, table


def _table(writer: _Writer, title: str, what: str, requests: Mapping[str, tuple[Any, Any]]) -> str:
    rows = []
    for name, pair in requests.items():
        message, answer = (writer.type_of(types.type_info(each)) for each in pair)
        rows.append(f'"{name}": {{ message: {message}; answer: {answer} }}')
    return f"/** {what} */\n{interface(title, rows)}"


def remote_types() -> str:
    """Return the text of remote.ts."""
    writer = _Writer()
    unions = [writer.union(name, getattr(remote_messages, name)) for name in ("RemoteMessage", "RemoteAnswer")]
    return "\n".join([_REMOTE_HEAD, *writer.interfaces.values(), *unions])


def class_types() -> str:
    """Return the text of classroom.ts."""
    service, _ = _service_types()
    for name, module in _UNIONS.items():
        service.union(name, getattr(module, name))
    writer = _Writer({*service.interfaces, "Sentence", "MatDocument"})
    tables = [
        _table(writer, title, f"The requests of {who}: `POST /api/{path}/<name>`.", _class_requests(f"{path}/"))
        for title, who, path in (("PupilRequests", "pupils", "class"), ("TeacherRequests", "the teacher", "teacher"))
    ]
    unions = [writer.union(name, answers) for name, answers in _CLASS_ANSWERS.items()]
    body = [*writer.interfaces.values(), *unions, *tables]
    imported = sorted(name for name in (*writer.imported, "Sentence", "MatDocument"))
    head = _CLASS_HEAD.replace("{names}", ", ".join(imported))
    head = head.replace("{files}", str(MOST_FILES)).replace("{bytes}", str(MOST_BYTES))
    return "\n".join([head, *body])


def _class_requests(prefix: str) -> dict[str, tuple[Any, Any]]:
    """Return the types of a class's requests whose names begin so, by what follows."""
    found = {name: each for name, (_, each) in CLASS_REQUESTS.items() if name.startswith(prefix)}
    return {name.removeprefix(prefix): each.request[:2] for name, each in found.items()}
