"""Read the text of files that people write, replace files whole, and say why that was not possible."""

import codecs
import errno
import json
import os
import re
import sys
import tomllib
from bisect import bisect_left
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from secrets import token_hex
from stat import S_ISDIR, S_ISREG
from typing import Any, BinaryIO, Literal

from motorcade.errors import InputError, MotorcadeError, Phrase

Kind = Literal["TOML", "JSON"]
# What a file's ending says.
KINDS: dict[str, Kind] = {".toml": "TOML", ".json": "JSON"}
# Deeper than anyone nests tables, lists or blocks by hand, and short of what Python's stack takes.
DEEPEST = 100
# No document, project or image has more.
MOST_BYTES = 1 << 24
# Python's reader of TOML takes a second and more for so many characters.
_MOST_OF_TOML = 1 << 20
_LONGEST_KEY = 40
# What a shell hands over to this program, pipes too. Whatever else is no file is neither read nor written.
_HANDED_OVER = re.compile(r"/dev/(stdin|stdout|stderr|null|fd/\d+)")
_UTF_16_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
# What a bracket or a line's end of TOML may stand in, and brackets and lines' ends; strings and comments come whole.
_TOML_TOKENS = re.compile(
    r"""\"{3}(?:[^\\]|\\.)*?\"{3,5}|'{3}.*?'{3,5}|"(?:[^"\\\n]|\\.)*"|'[^'\n]*'|\#[^\n]*|[\[\]{}\n]""", re.DOTALL
)
# A key of so many parts nests as deep; Python's reader takes time with the square of their number.
_DEEP_KEY = re.compile(rf"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){{{DEEPEST}}}""")
_DEPTHS = {"[": 1, "{": 1, "]": -1, "}": -1}
# The beginnings of the messages of Python's reader of JSON, and the phrase for each.
_JSON_REASONS = (
    ("Expecting value", "json-no-value"),
    ("Expecting property name", "json-no-key"),
    ("Expecting ','", "json-no-comma"),
    ("Expecting ':'", "json-no-colon"),
    ("Illegal trailing comma", "json-last-comma"),
    ("Extra data", "json-more"),
    ("Unterminated string", "json-open-text"),
    ("Invalid control character", "json-line-break"),
    ("Invalid \\", "json-backslash"),
)


class DuplicateKeyError(InputError):
    """A file has one key twice."""


class SaveError(MotorcadeError):
    """The disk doesn't take what is to be saved."""


@contextmanager
def raised_as(
    code: str,
    kind: type[Exception] | tuple[type[Exception], ...] = MotorcadeError,
    raised: type[MotorcadeError] = MotorcadeError,
    /,
    **details: Any,
) -> Iterator[None]:
    """Raise an error in place of what the block raises, which becomes its detail ``reason``.

    Args:
        code: the code of the error.
        kind: what it replaces.
        raised: its class.
        details: its other details.
    """
    try:
        yield
    except kind as problem:
        raise raised(code, **details, reason=problem) from None


def decoded(data: bytes) -> str:
    """Return the text in a file's bytes: UTF-8, or UTF-16 with its mark, as PowerShell writes. Raises UnicodeError."""
    return data.decode("utf-16" if data[:2] in _UTF_16_MARKS else "utf-8-sig")


def check_no_device(path: Path) -> None:
    """Raise OSError where a pipe or a device stands in place of a file: it may keep its reader, or writer, for ever.

    Nothing, and what a shell hands over, is none.
    """
    with suppress(FileNotFoundError):
        mode = path.stat().st_mode
        if not (S_ISREG(mode) or S_ISDIR(mode) or _HANDED_OVER.fullmatch(path.as_posix())):
            raise OSError(errno.ESPIPE, os.strerror(errno.ESPIPE), str(path))


def opened(path: Path) -> BinaryIO:
    """Open a file that somebody may have made, to read it.

    Raises OSError, also where it is a pipe or a device, and ValueError where no file has that name.
    """
    check_no_device(path)
    return path.open("rb")


def read_bytes(path: Path, most_bytes: int = MOST_BYTES) -> bytes:
    """Return the bytes of a file that somebody may have made.

    Raises OSError and ValueError as `opened`, and MotorcadeError where it has more than ``most_bytes``.
    """
    with opened(path) as file:
        data = file.read(most_bytes + 1)
    if len(data) > most_bytes:
        raise InputError("file-too-large", file=path, mebibytes=most_bytes >> 20)
    return data


def read_text(path: Path, file: str | Phrase) -> str:
    """Return the text at ``path``; ``file`` is what errors call it. Raises MotorcadeError unreadable-file."""
    try:
        return decoded(read_bytes(path)).replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeError:
        reason: object = Phrase("not-text")
    except OSError as problem:
        reason = problem
    except ValueError:
        reason = Phrase("bad-file-name")
    raise InputError("unreadable-file", file=file, reason=reason)


def parse(data: bytes | str, kind: Kind, file: str | Phrase, deepest: int | None = DEEPEST) -> Any:
    """Return the document in a file's bytes or text; ``file`` is what errors call it.

    Raises MotorcadeError: file-syntax, with the reason, where it is not TOML or JSON, no text or nested deeper than
    ``deepest`` (None: than Python's reader goes); file-too-large, where TOML has more than a million characters;
    duplicate-key where JSON has a key twice in one pair of braces.
    """
    try:
        if isinstance(data, bytes):
            data = decoded(data)
        # Raises where it has half a surrogate pair, which no sentence about it could hold.
        data.encode()
        if kind == "TOML" and len(data) > _MOST_OF_TOML:
            raise InputError("file-too-large", file=file, mebibytes=_MOST_OF_TOML >> 20)
        document = _from_toml(data) if kind == "TOML" else _from_json(data, file)
        if deepest is None or not is_deeper(document, deepest):
            return document
        reason = Phrase("too-deep")
    except UnicodeError:
        reason = Phrase("not-text")
    except RecursionError:
        reason = Phrase("too-deep")
    except _BadSyntaxError as problem:
        reason = problem.reason
    raise InputError("file-syntax", file=file, kind=kind, reason=reason)


_PLACE = re.compile(r"at line (\d+), column (\d+)")
# What Chinese keyboards and word processors write in place of TOML's own characters.
_WIDE = frozenset("“”‘’＂，＝［］｛｝：。、")


class _BadSyntaxError(Exception):
    def __init__(self, key: str, **details: object) -> None:
        self.reason = Phrase(key, **details)


def _from_toml(text: str) -> Any:
    if _DEEP_KEY.search(text):
        raise _BadSyntaxError("too-deep")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as problem:
        if found := _PLACE.search(str(problem)):
            line = int(found[1])
            column = int(found[2])
            character = text.splitlines()[line - 1][column - 1 : column]
            if character in _WIDE:
                raise _BadSyntaxError("toml-character", line=line, column=column, character=character) from None
        reason = str(problem).replace("end of document", f"its end, line {len(text.splitlines())}")
        raise _BadSyntaxError("toml-syntax", reason=reason) from None
    except ValueError:
        raise _BadSyntaxError("number-too-long") from None


def _from_json(text: str, file: str | Phrase) -> Any:
    def without_doubles(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        document = dict(pairs)
        if len(document) < len(pairs):
            names = [name for name, _ in pairs]
            double = next(name for name in names if names.count(name) > 1)
            # It may be half a surrogate pair, which the sentence could not hold.
            double.encode()
            raise DuplicateKeyError("duplicate-key", file=file, key=double)
        return document

    def refuse_constant(name: str) -> None:
        raise _BadSyntaxError("bad-number", number=name)

    try:
        document = json.loads(text, parse_constant=refuse_constant, object_pairs_hook=without_doubles)
    except json.JSONDecodeError as problem:
        where = {"line": problem.lineno, "column": problem.colno}
        reason = next((key for beginning, key in _JSON_REASONS if problem.msg.startswith(beginning)), "json-mistake")
        raise _BadSyntaxError("json-syntax", **where, reason=Phrase(reason)) from None
    except UnicodeError:
        raise
    except ValueError:
        raise _BadSyntaxError("number-too-long") from None
    if "\\ud" in text.lower():
        # JSON may spell out half a surrogate pair, yet no file can hold it.
        json.dumps(document, ensure_ascii=False).encode()
    return document


def is_deeper(document: Any, deepest: int) -> bool:
    """Whether ``document`` nests more than ``deepest`` tables or lists."""
    level = [document]
    for _ in range(deepest):
        parents = level
        level = []
        for parent in parents:
            if isinstance(parent, dict):
                level += parent.values()
            elif isinstance(parent, list):
                level += parent
        if not level:
            return False
    return True


def place_text(place: tuple[str | int, ...]) -> str | Phrase:
    """``("wall", 2, "to_m")`` as ``wall[2].to_m``; the whole of a document has a name in each language."""
    text = ""
    for part in place:
        if isinstance(part, int):
            text += f"[{part}]"
            continue
        if text:
            text += "."
        if part.isprintable() and len(part) <= _LONGEST_KEY:
            text += part
        else:
            text += ascii(part[:_LONGEST_KEY])
    return text or Phrase("whole-document")


def line_of(text: str, place: tuple[str | int, ...]) -> int:
    """The line, from 1, of valid TOML ``text`` on which the value at ``place`` is complete; the last where none is.

    Python's reader keeps no lines. The text up to the end of a statement is valid by itself, and holds the value from
    some statement on: bisection finds it. So the text is read a few times, however many lines it has.
    """
    ends = list(_statement_ends(text))
    first = bisect_left(ends[:-1], True, key=lambda end: _holds(tomllib.loads(text[:end]), place))
    return text.count("\n", 0, ends[first]) + 1


def _statement_ends(text: str) -> Iterator[int]:
    """Yield where a line of TOML ends outside of strings and brackets, and the end of the text."""
    depth = 0
    for token in _TOML_TOKENS.finditer(text):
        depth += _DEPTHS.get(token[0], 0)
        if token[0] == "\n" and depth == 0:
            yield token.start()
    yield len(text)


def _holds(value: Any, place: tuple[str | int, ...]) -> bool:
    for key in place:
        try:
            value = value[key]
        except (KeyError, IndexError, TypeError):
            return False
    return True


def write_secret(path: Path, data: bytes) -> None:
    """Write ``data`` to a new file that only its owner may read. Raises OSError, also where something is there."""
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        file.write(data)


def replace_file(path: Path, data: bytes) -> None:
    """Write ``data`` to ``path``; a crash at any moment leaves the old file or the new one, once this is done the new.

    Raises OSError where it can't be written; the old file is kept then. Only where the disk fails at the very end,
    while it stores the file's name, the new file may be there.
    """
    if _HANDED_OVER.fullmatch(path.as_posix()):
        path.write_bytes(data)
        return
    check_no_device(path)
    temporary = path.with_name(f".{path.name}.{token_hex(4)}")
    try:
        with temporary.open("xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    except OSError:
        temporary.unlink(missing_ok=True)
        raise
    _keep_names(path.parent)


# What a system answers that can write a folder to the disk, and fails; others can't do it and answer something else.
_FAILURES = (errno.EIO, errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC))


def _keep_names(folder: Path) -> None:
    """Write the folder itself to the disk: until then a power failure may bring the old file back. Raises OSError."""
    if sys.platform == "win32":
        return
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError:
        return
    try:
        os.fsync(handle)
    except OSError as problem:
        if problem.errno in _FAILURES:
            raise
    finally:
        os.close(handle)


@contextmanager
def locked(path: Path, refusal: MotorcadeError) -> Iterator[None]:
    """Lock a file, and its folder, for this process while the block runs; the system unlocks them however it ends.

    Who deletes the file unlocks nothing: a POSIX system lets them, and the folder stays locked.
    Raises ``refusal`` where another process has locked it, or OSError where it can't be made.
    """
    # Of the extras that lock anything.
    from filelock import FileLock, Timeout

    with ExitStack() as held:
        try:
            held.enter_context(FileLock(path, timeout=0))
        except Timeout:
            raise refusal from None
        if sys.platform != "win32":
            _lock_folder(path.parent, refusal, held)
        yield


def _lock_folder(folder: Path, refusal: MotorcadeError, held: ExitStack) -> None:
    """Lock a folder until ``held`` is closed. Windows needs no such lock: nobody can delete a file that is open."""
    import fcntl

    handle = os.open(folder, os.O_RDONLY)
    held.callback(os.close, handle)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise refusal from None
    except OSError:
        # Folders of some networks can't be locked.
        return
