"""A Python module as the source of a translation to C: its functions, constants, comments, and types in annotations."""

import ast
import io
import tokenize
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from motorcade.errors import MotorcadeError, Phrase

PREFIX = "motorcade"


class CType(NamedTuple):
    """A type in C; ``element`` is the type of what a sequence holds."""

    text: str
    element: str = ""

    def declares(self, name: str) -> str:
        """Return the declaration of ``name`` with this type."""
        return f"{self.text}{'' if self.text.endswith('*') else ' '}{name}"


UNSIGNED = CType("uint32_t")
SIGNED = CType("int32_t")
BYTE = CType("uint8_t")
SHORT = CType("uint16_t")
NOTHING = CType("void")
WORDS = CType("uint32_t *", "uint32_t")
BYTES = CType("uint8_t *", "uint8_t")
READ_ONLY_WORDS = CType("const uint32_t *", "uint32_t")
IMAGE = CType(f"const struct {PREFIX}_image *", "uint32_t")
CAR = CType(f"struct {PREFIX}_car *")
SENSES = CType(f"const struct {PREFIX}_senses *")
TYPES = {
    "int": UNSIGNED,
    "int32": SIGNED,
    "uint16": SHORT,
    "uint8": BYTE,
    "bool": BYTE,
    "None": NOTHING,
    "list[int]": WORDS,
    "tuple[int, ...]": READ_ONLY_WORDS,
    "bytearray": BYTES,
    "ImageWords": IMAGE,
    "Senses": SENSES,
    "Turn": CAR,
    "Done": NOTHING,
    # A method that returns it writes the next integer to a pointer, and returns 0 where there is none.
    "Iterable[int]": UNSIGNED,
}


# The annotations of an index of a memory, and the types of the integer there.
_HELD = {"uint8_at": BYTE, "uint16_at": SHORT}


class Constant(NamedTuple):
    """An integer that a module defines.

    Attributes:
        value: the integer.
        above, behind: the comments above and behind it.
        held: where it is an index of a memory, the type of the integer there.
    """

    value: int
    above: list[str]
    behind: str
    held: CType


class Source:
    """A module to be translated.

    Args:
        name: its short name, which is part of the names in C.
        file: the name of its file, for errors.
        text: its Python.
        values: its global names and their values.

    Attributes:
        functions: its functions by name.
        constants: its Constants by name.
        imported: for each imported name, the short name of its module and its name there, empty for the module itself.
        protocols: the classes that only the type checker reads, by name.
    """

    def __init__(self, name: str, file: str, text: str, values: Mapping[str, object]) -> None:
        self.name = name
        self.file = file
        tree = ast.parse(text)
        self._lines = text.splitlines()
        self._comments = _comments(text)
        self.functions = {each.name: each for each in tree.body if isinstance(each, ast.FunctionDef)}
        self.imported = dict(_imported(tree))
        self.protocols = {each.name: each for each in ast.walk(tree) if isinstance(each, ast.ClassDef)}
        self.constants = {
            name: Constant(value, self.comment_above(each), self._comments.get(each.lineno, ""), held)
            for name, each, held in _assigned(tree)
            if isinstance(value := values.get(name), int)
        }

    def fault(self, node: ast.AST, key: str, **details: object) -> MotorcadeError:
        """Return the error for ``node``, which has no counterpart in C; ``key`` is that of a phrase."""
        line = getattr(node, "lineno", 1)
        reason = Phrase(key, code=ast.unparse(node).partition("\n")[0][:80], **details)
        return MotorcadeError("no-c-for", file=self.file, line=line, reason=reason)

    def c_name(self, name: str) -> str:
        """Return the name in C of one of the module's functions or constants."""
        c_name = f"{PREFIX}_{self.name}_{name.lstrip('_')}"
        return c_name.upper() if name in self.constants else c_name

    def type_of(self, annotation: ast.expr | None, node: ast.AST) -> CType:
        """Return the type in C of the annotation of ``node``. Raises MotorcadeError where there is none."""
        text = "" if annotation is None else ast.unparse(annotation)
        if isinstance(annotation, ast.Constant) and isinstance(annotation.value, str):
            text = annotation.value
        # A class is named as brain.ImageWords, too.
        found = TYPES.get(text) or TYPES.get(text.rpartition(".")[2])
        if found is None:
            raise self.fault(node, "c-type", types=", ".join(TYPES))
        return found

    def comment_above(self, node: ast.stmt) -> list[str]:
        """Return the lines of the comment right above a statement."""
        lines: list[str] = []
        line = node.lineno - 1
        while line in self._comments and self._lines[line - 1].lstrip().startswith("#"):
            lines.insert(0, self._comments[line])
            line -= 1
        return lines


def number(value: int) -> str:
    """Return a literal in C; U marks what doesn't fit into an int of 16 bits."""
    if value < 1 << 15:
        return str(value)
    return f"{value}U" if value < 1 << 16 else f"0x{value:08X}U"


def in_comment(text: str) -> str:
    """Change ``text`` so that it neither ends a comment in C nor begins another."""
    return text.replace("*/", "* /").replace("/*", "/ *")


def _comments(text: str) -> dict[int, str]:
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    return {each.start[0]: in_comment(each.string[1:].strip()) for each in tokens if each.type == tokenize.COMMENT}


def _imported(tree: ast.Module) -> Iterator[tuple[str, tuple[str, str]]]:
    for each in tree.body:
        if isinstance(each, ast.ImportFrom):
            package, _, module = str(each.module).rpartition(".")
            for alias in each.names:
                # Modules are imported from a package of Motorcade, functions and constants from a module.
                yield alias.name, (module, alias.name) if "." in package else (alias.name, "")


def _assigned(tree: ast.Module) -> Iterator[tuple[str, ast.stmt, CType]]:
    """Yield the name of each constant, its statement, and the type of what is in a memory there."""
    for each in tree.body:
        target = (
            each.target
            if isinstance(each, ast.AnnAssign)
            else each.targets[0]
            if isinstance(each, ast.Assign)
            else None
        )
        if isinstance(target, ast.Name) and target.id.isupper():
            held = ast.unparse(each.annotation) if isinstance(each, ast.AnnAssign) else ""
            yield target.id, each, _HELD.get(held, UNSIGNED)
