"""The layout of the package: which part imports which, and how large files and functions are."""

import ast
from collections import Counter
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parent.parent
SOURCE = ROOT / "src" / "motorcade"
FILES = sorted(SOURCE.rglob("*.py"))
# What is written by hand beside it; tests/ also holds what npm installs.
OTHER_FILES = sorted(
    file
    for folder in ("tests", "benchmarks", "scripts")
    for file in (ROOT / folder).rglob("*.py")
    if "node_modules" not in file.parts
)
MOST_FILES = 250
MOST_LINES = 500
MOST_PARAMETERS = 8
# What a page is sent of these has their name too.
SAME_IN_MESSAGES = {"Diagnostic", "Fix", "Mission", "Resume", "Telemetry"}

# What every package may import: errors, their sentences, and what devices declare.
COMMON = ("devices", "errors", "extras", "locales", "outcomes")
# What else each package imports. A new package needs a line here first.
ARROWS = {
    "__init__": ("car", "cli", "config", "drive", "engine", "mats", "program", "runs", "words"),
    "__main__": ("cli",),
    "boards": ("cameras", "car", "config", "drive", "engine", "runs", "sockets", "words"),
    # It runs in a web page, where there is neither NumPy nor a web framework; and it writes the site of that page.
    "browser": ("config", "engine", "missions", "program", "service", "upload", "words"),
    "cameras": ("engine", "mats", "runs"),
    "car": ("words",),
    "classroom": ("config", "drive", "engine", "missions", "server", "service", "sockets", "timing", "words"),
    # The command line may import everything, and only __init__, for `show`, imports it.
    "cli": ("",),
    "config": ("car", "words"),
    "devices": (),
    "drive": ("car", "config", "sockets", "timing", "words"),
    "engine": ("car", "config", "mats", "words"),
    "errors": (),
    "extras": (),
    "experiments": ("car", "config", "engine", "mats", "words"),
    "fleet": ("config", "drive", "sockets", "timing", "upload", "words"),
    "firmware": ("boards", "config", "upload"),
    "lab": ("__version__", "config", "engine", "experiments", "mats", "missions", "program", "runs", "words"),
    "locales": (),
    "mats": ("config",),
    "missions": ("car", "config", "engine", "mats", "program", "words"),
    "outcomes": (),
    "program": ("config", "words"),
    "runs": ("config", "engine", "mats", "words"),
    "server": (
        *("boards", "cameras", "config", "drive", "fleet", "mats"),
        *("runs", "service", "sockets", "timing", "upload", "words"),
    ),
    # It also runs where there is neither a web framework nor NumPy.
    "service": ("car", "config", "engine", "mats", "missions", "program", "upload", "words"),
    "sockets": (),
    "timing": ("words",),
    "upload": ("sockets", "timing", "words"),
    "words": (),
}
# A real car carries no simulator: this file of boards alone may import one.
SIMULATED = ("boards.simulated_drive",)

# What a class does, without a server: these files import only what runs in a page's worker too.
CLASS_CORE = ("messages", "names", "pairs", "record", "room")


def name_of(file):
    return ".".join(file.relative_to(SOURCE).with_suffix("").parts).removesuffix(".__init__")


NAMES = {name_of(file): file for file in FILES}


@cache
def tree_of(name):
    return ast.parse(NAMES[name].read_text(encoding="utf-8"))


def imported_by(name):
    """What a file imports of the package, such as ``words.image`` or ``car.loop.Car``; inside functions too."""
    for node in ast.walk(tree_of(name)):
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports here are absolute"
            full = [f"{node.module}.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.Import):
            full = [alias.name for alias in node.names]
        else:
            continue
        yield from (each.removeprefix("motorcade.") for each in full if f"{each}.".startswith("motorcade."))


def files_imported_by(name):
    """The files that a file imports, by name."""
    for imported in imported_by(name):
        target = imported if imported in NAMES else imported.rpartition(".")[0]
        if target in NAMES and target != name:
            yield target


def test_a_file_imports_only_what_its_package_may():
    assert {name.partition(".")[0] for name in NAMES} <= set(ARROWS), "say in ARROWS what a new package may import"
    wrong = []
    for name in NAMES:
        package = name.partition(".")[0]
        allowed = tuple(f"{each}.".lstrip(".") for each in (package, *COMMON, *ARROWS[package]))
        wrong += [(name, each) for each in imported_by(name) if not f"{each}.".startswith(allowed)]
    assert wrong == []


def test_real_cars_import_no_engine():
    waiting = [name for name in NAMES if name.startswith("boards.") and name not in SIMULATED]
    reached = set()
    while waiting:
        if (name := waiting.pop()) not in reached:
            reached.add(name)
            waiting += files_imported_by(name)
    assert [name for name in sorted(reached) if name.startswith(("cameras", "engine", "runs"))] == []


def test_the_core_of_a_class_knows_no_server():
    core = [f"classroom.{name}" for name in CLASS_CORE]
    allowed = tuple(f"{each}." for each in (*core, "service", "timing", *COMMON))
    assert [(name, each) for name in core for each in imported_by(name) if not f"{each}.".startswith(allowed)] == []


def test_every_arrow_is_used():
    used = {(name.partition(".")[0], each.partition(".")[0]) for name in NAMES for each in imported_by(name)}
    listed = {(package, target) for package, targets in ARROWS.items() for target in targets if target}
    assert listed - used == set()


def test_no_files_import_each_other_in_a_circle():
    """Imports for the type checker count too. A file that is left over when leaves are taken away is in a circle."""
    graph = {name: set(files_imported_by(name)) for name in NAMES}
    for reversed_graph in (False, True):
        while leaves := {name for name, targets in graph.items() if not targets}:
            graph = {name: targets - leaves for name, targets in graph.items() if name not in leaves}
        if not reversed_graph:
            graph = {name: {other for other in graph if name in graph[other]} for name in graph}
    assert set(graph) == set()


def test_the_package_has_few_files():
    assert len(FILES) <= MOST_FILES


def test_files_are_short_enough_to_read():
    lines = {file: len(file.read_text(encoding="utf-8").splitlines()) for file in (*FILES, *OTHER_FILES)}
    assert {file.relative_to(ROOT).as_posix(): count for file, count in lines.items() if count > MOST_LINES} == {}


def test_a_name_of_a_class_means_one_thing():
    names = [node.name for name in NAMES for node in ast.walk(tree_of(name)) if isinstance(node, ast.ClassDef)]
    assert {name for name, count in Counter(names).items() if count > 1} == SAME_IN_MESSAGES


def test_a_name_of_a_double_means_one_thing():
    """Among all tests; those of MicroPython's own modules have their names."""
    found = Counter()
    for file in OTHER_FILES:
        if file.is_relative_to(ROOT / "tests") and not file.is_relative_to(ROOT / "tests" / "portable" / "simulated"):
            tree = ast.parse(file.read_text(encoding="utf-8"))
            found.update(node.name for node in tree.body if isinstance(node, ast.ClassDef))
    assert {name: count for name, count in found.items() if count > 1} == {}


def parameters_of(function):
    arguments = function.args
    names = [each.arg for each in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)]
    return names[1:] if names[:1] in (["self"], ["cls"]) else names


def test_functions_have_few_parameters():
    """A command of the command line has one for each of its options, and doesn't count."""
    too_many = [
        f"{name}.{node.name}"
        for name in NAMES
        for node in ast.walk(tree_of(name))
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))
        and len(parameters_of(node)) > MOST_PARAMETERS
        and "typer." not in ast.unparse(node.args)
    ]
    assert too_many == []
