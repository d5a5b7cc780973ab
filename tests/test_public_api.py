"""What `import motorcade` offers, and how much it imports."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import motorcade
from motorcade.program.steps import KINDS
from support.waiting import DEADLINE_S

PUBLIC = {
    "words": ["CONTROL", "DRIVE", "FRAME", "HEADER", "LIGHTS", "WordError"],
    "programs": ["Compiled", "Followers", "Program", "ProgramError", "compile_program", "decompile", "read_program"],
    "steps": [name for kind in KINDS.values() for name in kind.names],
    "deciding": [
        *("chance", "change_counter", "counter", "dark", "do", "flow", "forever", "heard", "if_", "obstacle"),
        *("person", "random", "repeat_until", "set_counter", "tell"),
    ],
    "mats": ["Mat", "Physics", "Pose", "formation", "open_table", "read_mat"],
    "boards": ["BoardObserver", "check_board"],
    "driving": ["BlockingDriveClient", "DriveClient"],
    "errors": ["DriveError", "InputError", "MatError", "MotorcadeError", "TransferError"],
    "cars": ["Profile", "load_profile", "World", "simulate", "show"],
}
NAMES = sorted(["__version__", *(name for names in PUBLIC.values() for name in names)])


def after(statement):
    """The modules that a fresh Python has imported after ``statement``."""
    script = f"{statement}; import sys; print('\\n'.join(sys.modules))"
    return subprocess.check_output([sys.executable, "-c", script], text=True, timeout=DEADLINE_S).split()


def test_the_public_names_are_these():
    assert sorted(motorcade.__all__) == NAMES


def test_each_public_name_imports():
    for name in NAMES:
        space = {}
        exec(f"from motorcade import {name}", space)
        assert space[name] is getattr(motorcade, name), name


def test_dir_and_star_give_the_public_names_and_no_others():
    space = {}
    exec("from motorcade import *", space)
    assert set(NAMES) == set(dir(motorcade)) == set(space) - {"__builtins__"}


def test_a_type_checker_sees_the_same_names():
    tree = ast.parse(Path(motorcade.__file__).read_text(encoding="utf-8"))
    checked = [node for node in tree.body if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"]
    lines = [line for node in checked for line in node.body]
    seen = {alias.asname: (line.module, alias.name) for line in lines for alias in line.names}
    assert sorted([*seen, "__version__"]) == NAMES
    for name, (module, original) in seen.items():
        assert name == original
        assert getattr(motorcade, name) is getattr(sys.modules[module], original)


def test_a_name_that_is_not_there_is_an_attribute_error_that_names_it():
    with pytest.raises(AttributeError, match="module 'motorcade' has no attribute 'backward'"):
        motorcade.backward  # noqa: B018
    with pytest.raises(ImportError, match="backward"):
        exec("from motorcade import backward")


def test_import_motorcade_imports_nothing_else_of_ours_and_nothing_of_others():
    new = set(after("import motorcade")) - set(after("pass"))
    assert {name for name in new if name.partition(".")[0] not in sys.stdlib_module_names} == {"motorcade"}


@pytest.mark.parametrize(
    ("statement", "heavy"),
    [
        ("from motorcade import CONTROL, WordError", ("motorcade.program", "jsonschema_rs")),
        (
            "from motorcade import Program, forward, compile_program; compile_program(Program([forward(1)]))",
            ("numba", "matplotlib"),
        ),
        (
            "from motorcade import BlockingDriveClient, DriveClient",
            ("motorcade.program", "cryptography", "blessed"),
        ),
    ],
    ids=["words", "programs", "driving"],
)
def test_what_needs_few_modules_imports_few(statement, heavy):
    heavy += ("motorcade.engine", "motorcade.upload", "numpy", "serial", "rich", "typer")
    assert not [name for name in after(statement) if name.startswith(heavy)]
