"""The source as parsed trees: two million nodes, which the garbage collector would look at again and again."""

import ast
import gc
from functools import cache
from pathlib import Path


@cache
def tree_of(file: Path) -> ast.Module:
    """Return the tree of a file. It stays, and the collector passes over it, as over all that is there by then."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    gc.freeze()
    return tree
