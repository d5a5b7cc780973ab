"""The classes of errors: each code is raised as one of them, and callers catch classes instead of comparing codes."""

import ast
from collections import defaultdict
from pathlib import Path

import motorcade
from motorcade.errors import MotorcadeError
from support.source_trees import tree_of

SOURCE = Path(motorcade.__file__).parent
# What has a code and is no error: faults of documents, diagnostics of programs, the program of a worker. And an error
# that is made of a car's answer.
COMPARED = {"fault.code", "self.code", "diagnostic.code", "task.code", "error.code"}


def trees():
    """The parsed files by their names. Not at import: every process that runs tests imports this file."""
    return {path.relative_to(SOURCE).as_posix(): tree_of(path) for path in SOURCE.rglob("*.py")}


def classes():
    """The names of MotorcadeError and of all that derive from it; not those of one file alone."""
    bases = {
        node.name: {base.id for base in node.bases if isinstance(base, ast.Name)}
        for tree in trees().values()
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef)
    }
    found = {"MotorcadeError"}
    while more := {name for name, of in bases.items() if of & found} - found:
        found |= more
    return {name for name in found if not name.startswith("_")}


def raised():
    """The names of the classes that each code is raised as."""
    known, found = classes(), defaultdict(set)
    for tree in trees().values():
        for call in (node for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)):
            if not call.args or not isinstance(call.args[0], ast.Constant):
                continue
            if call.func.id in known:
                found[call.args[0].value].add(call.func.id)
            if call.func.id == "raised_as":
                found[call.args[0].value].add(ast.unparse(call.args[2]) if len(call.args) > 2 else "MotorcadeError")
    return found


def test_each_code_is_raised_as_one_class():
    found = raised()
    assert len(found) > 300
    assert {code: names for code, names in found.items() if len(names) > 1} == {}


def test_nobody_compares_the_code_of_an_error():
    compared = {
        (name, ast.unparse(side))
        for name, tree in trees().items()
        for node in ast.walk(tree)
        if isinstance(node, ast.Compare)
        for side in (node.left, *node.comparators)
        if isinstance(side, ast.Attribute) and side.attr == "code"
    }
    assert {place for place in compared if place[1] not in COMPARED} == set()


def test_the_classes_that_callers_may_catch_are_one_tree():
    public = [getattr(motorcade, name) for name in motorcade.__all__ if name.endswith("Error")]
    assert MotorcadeError in public
    assert all(issubclass(kind, MotorcadeError) for kind in public)
    assert issubclass(motorcade.MatError, motorcade.InputError)
