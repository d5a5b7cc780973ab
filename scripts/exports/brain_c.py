"""The brain of a car in C99: what it does in a tick, its frames, and its receiver of uploads.

The files are translated from the Python of the same functions, by `scripts.exports.c_functions`.
"""

import ast
from pathlib import Path

from motorcade.car import brain, decisions, frames, step
from motorcade.car.senses import Senses
from motorcade.words import blocks, flow, infrared, positions, receiver, request, ticks

from .c_expressions import declared_function
from .c_functions import Program, comment, documented
from .c_source import CAR, PREFIX, WORDS, Source, number
from .templates import filled_template

# Which modules are in C, in the order of the files.
_MODULES = (ticks, infrared, blocks, positions, request, flow, receiver, brain, frames, decisions, step)
# All functions of these, and whatever they need of the others.
_WHOLE = ("receiver", "brain", "frames", "decisions", "step")
# Python has these functions by itself; in C they are a part of the template.
_SUPPLIED = frozenset({"blocks"})
# The class that declares what the functions need of a car.
_CAR = "Turn"
_STEM = f"{PREFIX}_brain"


def brain_c() -> dict[str, str]:
    """Return the header and the source by their file names. Raises MotorcadeError where Python has no counterpart."""
    program = Program(tuple(_source(module.__name__) for module in _MODULES), _SUPPLIED)
    return files(program)


def _source(name: str) -> Source:
    module = next(each for each in _MODULES if each.__name__ == name)
    path = Path(str(module.__file__))
    return Source(name.rpartition(".")[2], path.name, path.read_text(encoding="utf-8"), vars(module))


def files(program: Program) -> dict[str, str]:
    """Return the header and the source of a program that has the modules of the brain."""
    for module in _WHOLE:
        source = program.sources[module]
        for name, node in source.functions.items():
            program.function(source, name, node, source)
    blocks_in_c = program.sources["blocks"]
    supplied = {
        place: "\n".join(_declared(blocks_in_c, blocks_in_c.functions[name]))
        for place, name in (("CHECKSUM", "crc32_of"), ("MOVE", "move_to_start"))
    }
    header = filled_template(
        "brain.h",
        PREFIX=PREFIX,
        SENSES="\n".join(f"    uint32_t {name};" for name in Senses._fields),
        CAR="\n".join(_car(program.sources["step"])),
        MODULES="\n".join(line for source in program.sources.values() for line in _public(program, source)),
    )
    definitions = "\n".join(line for source in program.sources.values() for line in _defined(program, source))
    code = filled_template("brain.c", STEM=_STEM, MODULES=definitions, **supplied)
    return {f"{_STEM}.h": header, f"{_STEM}.c": code}


def _declared(source: Source, node: ast.FunctionDef) -> list[str]:
    return [*documented(node), declared_function(source, node, source.c_name(node.name)).declaration()]


def _car(source: Source) -> list[str]:
    """Return the struct of a car and the declarations of its functions, by the class that declares them in Python."""
    members = [each for each in source.protocols[_CAR].body if isinstance(each, ast.FunctionDef)]
    lines = ["/* A car. The board may put it first into a larger struct of its own. */", f"{CAR.text[:-2]} {{"]
    functions = []
    for each in members:
        if each.decorator_list:
            about = " ".join(documented(each))
            lines.append(f"    {source.type_of(each.returns, each).declares(each.name)}; {about}")
            continue
        found = declared_function(source, each, f"{PREFIX}_car_{each.name}")
        parameters = (("car", CAR), *found.parameters)
        functions += ["", *documented(each)]
        if isinstance(each.returns, ast.Subscript):
            parameters = (*parameters, ("next", WORDS))
            functions.append("/* C: write the next one to `next` and return 1; return 0 where there is none left. */")
        functions.append(f"{found._replace(parameters=parameters).declaration()};")
    return [*lines, "};", *functions]


def _public(program: Program, source: Source) -> list[str]:
    """Return a module's part of the header: constants and functions."""
    constants = [
        name
        for name in source.constants
        if not name.startswith("_") and (source.name in _WHOLE or (source.name, name) in program.constants)
    ]
    lines = _defines(source, constants)
    for name, node in source.functions.items():
        if not name.startswith("_") and ((source.name, name) in program.bodies or source.name in _SUPPLIED):
            lines += ["", *_declared(source, node)]
            lines[-1] += ";"
    return [f"/* {source.name} */", "", *lines, ""] if lines else []


def _defines(source: Source, names: list[str]) -> list[str]:
    """Return the definitions of constants, with their comments."""
    lines = []
    for name in names:
        found = source.constants[name]
        behind = comment([found.behind] if found.behind else [])
        lines += [*comment(found.above), " ".join([f"#define {source.c_name(name)} {number(found.value)}", *behind])]
    return lines


def _defined(program: Program, source: Source) -> list[str]:
    """Return a module's part of the source: private constants, and the definitions of functions, callees first."""
    private = [name for name in source.constants if name.startswith("_") and (source.name, name) in program.constants]
    lines = _defines(source, private)
    for (module, name), body in program.bodies.items():
        if module == source.name:
            node = source.functions[name]
            lines += ["", *documented(node), f"{'static ' if name.startswith('_') else ''}{body[0]}", *body[1:]]
    return ["", f"/* {source.name} */", *([""] if private else []), *lines] if lines else []
