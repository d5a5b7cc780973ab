"""The layout of the package: which part imports which, and how large files and functions are."""

import ast
import re
from collections import Counter
from functools import cache
from pathlib import Path

from support.code_size import size_of
from support.source_trees import tree_of

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
MOST_FILES = 281
MOST_LINES = 500
# Of all code: how large it is, and how much stands in a line.
MOST_TOKENS = 410_000
MOST_TOKENS_A_LINE = 9.65
MOST_CONDITIONALS_IN_1000_LINES = 12
MOST_PARAMETERS = 8
# What a page is sent of these has their name too.
SAME_IN_MESSAGES = {"Diagnostic", "Fix", "Mission", "Resume", "Telemetry"}

# The wings of the house. Within its wing a package imports only packages that stand before it.
WINGS = {
    "core": (
        "outcomes",
        "locales",
        "errors",
        "extras",
        "imports",
        "devices",
        "words",
        "timing",
        "sockets",
        "car",
        "config",
    ),
    "program": ("program",),
    "simulate": ("mats", "engine", "runs", "missions"),
    "connect": ("cameras", "upload", "drive", "fleet"),
    "hardware": ("boards", "firmware"),
    "page": ("service", "browser", "server", "classroom"),
    "lab": ("lab",),
    "cli": ("cli",),
}
# Which wing imports which, beside itself. A new arrow needs its reason.
ARROWS = {
    "core": (),
    "program": ("core",),
    "simulate": ("core", "program"),
    "connect": ("core",),
    "hardware": ("core", "connect"),
    "page": ("core", "program", "simulate", "connect", "hardware"),
    "lab": ("core", "program", "simulate"),
    "cli": ("core", "program", "simulate", "connect", "hardware", "page", "lab"),
}
# The public names, and what starts the command line. Only `show` of it is in the command line, and nothing in the lab.
TOP = {"__init__": ("core", "program", "simulate", "connect", "cli"), "__main__": ("cli",)}
# What single packages don't import, though their wing may.
NEVER = {
    # They meet only in a word.
    "program": ("car",),
    # They also run in a worker of a page, where there is neither a web framework nor NumPy, and no car but by cable.
    "service": ("cameras", "drive", "fleet", "hardware", "runs"),
    "browser": ("cameras", "drive", "fleet", "hardware", "runs"),
}

# Who reads files of the package, or what this program has just made. What others may have made is opened in
# `config.files`, where no pipe, no device and no endless file keeps a reader.
READ_OWN_FILES = {
    *("browser.site", "cli.words", "config.files", "config.profile", "engine.linear_memory", "engine.saving"),
    *("engine.webassembly", "engine.world", "extras", "firmware.arduino_library", "firmware.car_files"),
    *("firmware.install", "imports", "lab.capsule", "lab.plan", "locales", "missions.check", "missions.document"),
    "service.documents",
}

# What a class does, without a server: these files import only what runs in a page's worker too.
CLASS_CORE = ("messages", "names", "pairs", "record", "room")


def name_of(file):
    return ".".join(file.relative_to(SOURCE).with_suffix("").parts).removesuffix(".__init__")


NAMES = {name_of(file): file for file in FILES}


@cache
def nodes_of(name):
    return list(ast.walk(tree_of(NAMES[name])))


@cache
def imported_by(name):
    """What a file imports of the package, such as ``words.image`` or ``car.loop.Car``; inside functions too."""
    found = []
    for node in nodes_of(name):
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports here are absolute"
            found += [f"{node.module}.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
    return [each.removeprefix("motorcade.") for each in found if f"{each}.".startswith("motorcade.")]


def files_imported_by(name):
    """The files that a file imports, by name."""
    for imported in imported_by(name):
        target = imported if imported in NAMES else imported.rpartition(".")[0]
        if target in NAMES and target != name:
            yield target


def package_of(name):
    return name.partition(".")[0]


WING_OF = {package: wing for wing, packages in WINGS.items() for package in packages}


def may_import(package, target):
    """Whether a file of ``package`` may import from the package ``target``."""
    if target == package or target == "__version__":
        return True
    if package in TOP:
        return WING_OF[target] in TOP[package]
    wing, wing_of_target = WING_OF[package], WING_OF[target]
    if {target, wing_of_target} & set(NEVER.get(package, ())):
        return False
    if wing != wing_of_target:
        return wing_of_target in ARROWS[wing]
    return WINGS[wing].index(target) < WINGS[wing].index(package)


def test_a_file_imports_only_what_its_wing_may():
    assert {package_of(name) for name in NAMES} == {*WING_OF, *TOP}, "say in WINGS where a package belongs"
    wrong = []
    for name in NAMES:
        wrong += [(name, used) for used in imported_by(name) if not may_import(package_of(name), package_of(used))]
    assert wrong == []


def is_reading(node):
    """Whether a node is a call that reads a file by its path."""
    if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
        return False
    modes = [mode.value for mode in node.args[:1] if isinstance(mode, ast.Constant)]
    return node.func.attr in ("read_bytes", "read_text") or (node.func.attr == "open" and modes == ["rb"])


def test_what_others_may_have_made_is_opened_in_one_place():
    assert {name for name in NAMES if any(map(is_reading, nodes_of(name)))} == READ_OWN_FILES


def test_only_the_commands_of_the_laboratory_import_it():
    outside = [
        name for name in NAMES if package_of(name) != "lab" and any(x.startswith("lab.") for x in imported_by(name))
    ]
    assert outside == ["cli.missions", "cli.runs"]


def test_the_core_of_a_class_knows_no_server():
    core = [f"classroom.{name}" for name in CLASS_CORE]
    allowed = tuple(f"{name}." for name in (*core, "service", *WINGS["core"][:8]))
    assert [(name, used) for name in core for used in imported_by(name) if not f"{used}.".startswith(allowed)] == []


def test_every_arrow_is_used():
    wings = {"__version__": "core", **WING_OF, **{package: package for package in TOP}}
    used = {(wings[package_of(name)], wings[package_of(used)]) for name in NAMES for used in imported_by(name)}
    listed = {(wing, target) for wing, targets in (ARROWS | TOP).items() for target in targets}
    assert listed - used == set()


def test_the_table_of_packages_has_the_wings():
    """CONTRIBUTING.md groups its table by wing: a row that names the wing, then a row for each of its packages."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    table = text.partition("| **core** |")[2].partition("\n\n")[0]
    wing, found = "core", {wing: set() for wing in WINGS}
    for row in table.split("\n"):
        first = row.split("|")[1]
        if heading := re.search(r"\*\*(\w+)\*\*", first):
            wing = heading[1]
        found[wing].update(re.findall(r"`(\w+)(?:\.py|/)`", first))
    assert found == {wing: set(packages) for wing, packages in WINGS.items()}


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


def test_the_code_is_small_and_a_line_holds_one_thought():
    sizes = [size_of(file.read_text(encoding="utf-8"), nodes_of(name)) for name, file in NAMES.items()]
    tokens, lines = sum(size.tokens for size in sizes), sum(size.lines for size in sizes)
    conditionals = sum(size.conditionals for size in sizes)
    assert tokens <= MOST_TOKENS
    assert tokens / lines <= MOST_TOKENS_A_LINE
    assert conditionals * 1000 / lines <= MOST_CONDITIONALS_IN_1000_LINES


def test_a_variable_is_named_after_what_it_holds():
    named_each = [
        f"{name}, line {node.lineno}"
        for name in NAMES
        for node in nodes_of(name)
        if isinstance(node, ast.Name) and node.id == "each" and isinstance(node.ctx, ast.Store)
    ]
    assert named_each == []


def test_a_name_of_a_class_means_one_thing():
    names = [node.name for name in NAMES for node in nodes_of(name) if isinstance(node, ast.ClassDef)]
    assert {name for name, count in Counter(names).items() if count > 1} == SAME_IN_MESSAGES


def test_a_name_of_a_double_means_one_thing():
    """Among all tests; those of MicroPython's own modules have their names."""
    found = Counter()
    for file in OTHER_FILES:
        if file.is_relative_to(ROOT / "tests") and not file.is_relative_to(ROOT / "tests" / "portable" / "simulated"):
            text = re.sub(r"(\"\"\"|''')[\s\S]*?\1", "", file.read_text(encoding="utf-8"))
            found.update(re.findall(r"^class (\w+)", text, re.MULTILINE))
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
        for node in nodes_of(name)
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))
        and len(parameters_of(node)) > MOST_PARAMETERS
        and "typer." not in ast.unparse(node.args)
    ]
    assert too_many == []
