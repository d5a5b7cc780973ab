"""Measure how large code is: by tokens, which folding lines doesn't change."""

import ast
import io
import tokenize
from collections.abc import Sequence
from typing import NamedTuple

_TOKENS = (tokenize.NAME, tokenize.OP, tokenize.NUMBER, tokenize.STRING)
_WITH_DOCSTRING = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


class CodeSize(NamedTuple):
    """How large a file is.

    Attributes:
        tokens: names, operators, numbers, and strings that are no docstrings.
        lines: those that hold such a token.
        conditionals: expressions ``a if b else c``.
    """

    tokens: int
    lines: int
    conditionals: int


def size_of(text: str, nodes: Sequence[ast.AST]) -> CodeSize:
    """Return how large a file is, by its text and the nodes of its tree."""
    docstrings = set()
    for node in nodes:
        if isinstance(node, _WITH_DOCSTRING) and ast.get_docstring(node, clean=False) is not None:
            docstrings.add((node.body[0].lineno, node.body[0].col_offset))
    tokens, lines = 0, set[int]()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type in _TOKENS and token.start not in docstrings:
            tokens += 1
            lines.update(range(token.start[0], token.end[0] + 1))
    conditionals = sum(isinstance(node, ast.IfExp) for node in nodes)
    return CodeSize(tokens, len(lines), conditionals)
