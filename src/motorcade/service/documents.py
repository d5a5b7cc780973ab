"""Project files, with the program, the mat and the layout of the blocks; and the example projects."""

from dataclasses import replace
from importlib import resources
from typing import Any, Literal

import msgspec

from motorcade.errors import MotorcadeError, Phrase
from motorcade.mats.document import document_in, mat_of
from motorcade.program.blocks import LEADER_HAT, PREFIX, Workspace, blocks_of
from motorcade.program.blocks_reader import program_of
from motorcade.program.diagnostics import NotJsonError, ProgramError
from motorcade.program.model import Program, program_from_dict, read_document
from motorcade.program.python_reader import read_python
from motorcade.program.reactions import minding
from motorcade.program.schema import FORMAT
from motorcade.program.steps import TogetherStep
from motorcade.service.messages import Blocks, Difficulty, Example, MatDocument, Project, sentences

# Each is the file ``gallery/<id>.motorcade.json``, in the order in which the page lists them; with its difficulty.
EXAMPLES: dict[str, Difficulty] = {
    "town": 1,
    "square": 1,
    "traffic-light": 1,
    "parade": 1,
    "herd": 2,
    "listen": 2,
    "polite": 2,
    "dance": 3,
    "ripple": 3,
    "pit-stop": 3,
    "statues": 3,
}

# What may be written as a drive that minds something.
_OLDER = f"{PREFIX}{TogetherStep.kind}"
# What a block has beside what its step says.
_PLACED = ("x", "y", "next", "icons", "collapsed")
# What a project keeps of the page beside its blocks.
_SETTINGS = ("range_mm", "python", "level", "car")

# Other files of Motorcade that users open by mistake: the format's name, and the sentence that says where they belong.
_NO_PROJECTS = {
    "motorcade-mat": "mat-not-project",
    "motorcade-mission": "mission-not-project",
    "motorcade-projects": "projects-not-project",
}


def project_text(project: Project) -> str:
    """Return the text of the project's file.

    Blocks that aren't a valid program yet are stored too; the file's program has no steps then.
    """
    settings = {name: value for name in _SETTINGS if (value := msgspec.to_builtins(getattr(project, name))) is not None}
    view = {"leader": project.leader, "followers": project.followers, **settings}
    if project.mat is None:
        beside = {"view": view}
    else:
        beside = {"mat": project.mat, "view": view}
    return replace(whole_program(project), beside=beside).as_json()


def open_text(text: str | bytes) -> Project:
    """Return the project in a file's text, with the stored layout of its blocks if they still make its program.

    Raises ProgramError where the text isn't a project file, or blocks can't express its program.
    """
    document = read_document(text)
    program = program_from_dict(document)
    view = document.get("view")
    leader, followers = _minding(_stored_blocks(view, program) or blocks_of(program))
    own = (setting(view, name) for name in _SETTINGS)
    return Project(leader, followers, program.profile, document.get("mat"), *own)


def open_file(text: str) -> Project:
    """Return the project, or the Python text, in a file that a user chose.

    Raises MotorcadeError, which says what other files are, or ProgramError.
    """
    try:
        document = read_document(text)
    except NotJsonError as problem:
        if "motorcade-program" in text:
            raise MotorcadeError("project-not-whole", reason=problem) from None
        if "from motorcade import" in text:
            return msgspec.structs.replace(project_of(read_python(text).program), python=text)
        raise MotorcadeError("not-a-project") from None
    file_format = None
    if isinstance(document, dict):
        file_format = document.get("format")
    if file_format == FORMAT:
        return open_text(text)
    kind = str(file_format).partition("/")[0]
    if kind == FORMAT.partition("/")[0]:
        raise MotorcadeError("newer-project", format=file_format, known=FORMAT)
    raise MotorcadeError(_NO_PROJECTS.get(kind, "not-a-project"))


def text_format(text: str) -> Literal["JSON", "TOML"]:
    """Return the format of a file's text."""
    if text.lstrip("\ufeff \t\r\n").startswith("{"):
        return "JSON"
    return "TOML"


def open_mat(text: str, name: str) -> MatDocument:
    """Return the mat in a file that a user chose: TOML or JSON, its own or a project's; errors call the file ``name``.

    Raises MotorcadeError.
    """
    document: MatDocument = document_in(text, name, text_format(text))
    mat_of(document, Phrase("mat-named", name=name))
    return document


def project_of(program: Program) -> Project:
    """Return a project for a program without a layout. Raises ProgramError where blocks can't express it."""
    return Project(*_minding(blocks_of(program)), program.profile)


def setting(view: Any, name: str) -> Any:
    """Return one stored setting of the page; None where the file has no valid one."""
    kind = next(field.type for field in msgspec.structs.fields(Project) if field.name == name)
    try:
        return msgspec.convert(view.get(name) if isinstance(view, dict) else None, kind)
    except msgspec.ValidationError:
        return None


def _stored_blocks(view: Any, program: Program) -> tuple[Workspace, Workspace | None] | None:
    """Return the workspaces in ``view``; None unless they make ``program``."""
    try:
        own = {"profile": program.profile, **dict.fromkeys(_SETTINGS)}
        stored = msgspec.convert({**(view or {}), **own}, Project)
    except msgspec.ValidationError:
        return None
    if whole_program(stored) != program:
        return None
    return stored.leader, stored.followers


def _minding(workspaces: tuple[Workspace, Workspace | None]) -> tuple[Workspace, Workspace | None]:
    """Return workspaces, which are changed: drives mind what stood beside them in a together, and dark floor."""
    left: list[Any] = [state for state in workspaces if state]
    while left:
        part = left.pop()
        places = enumerate(part) if isinstance(part, list) else part.items()
        for key, inner in [*places]:
            if isinstance(inner, dict | list):
                part[key] = _opened(inner)
                left.append(part[key])
    return workspaces


def _opened(block: Any) -> Any:
    """Return a block of an older project as that of the drive which minds all that it does; anything else as it is."""
    if isinstance(block, list) or block.get("type") != _OLDER:
        return block
    if _has_more(block.get("inputs", {}).get("STEPS", {}).get("block")):
        return block
    alone = {key: value for key, value in block.items() if key != "next"}
    hat = {"type": LEADER_HAT, "next": {"block": alone}}
    program = whole_program(Blocks({"blocks": {"blocks": [hat]}}))
    minds = minding(program)
    if minds == program:
        return block
    leader, _ = blocks_of(minds)
    made = leader["blocks"]["blocks"][0]["next"]["block"]
    return {**made, **{key: block[key] for key in _PLACED if key in block}}


def _has_more(block: Any) -> bool:
    """Whether a block of a row, or one below it, has a comment or is switched off, which no program says."""
    while block:
        if not block.keys() <= {"type", "id", "fields", "inputs", "next"}:
            return True
        block = block.get("next", {}).get("block")
    return False


def whole_program(blocks: Blocks) -> Program:
    """Return the program of the blocks; one without steps where they aren't a valid program yet."""
    try:
        return program_of(blocks.leader, blocks.followers, blocks.profile)
    except ProgramError:
        return Program([], profile=blocks.profile)


def examples() -> list[Example]:
    """Return all examples, with titles in every language."""
    return [
        Example(
            name, sentences(Phrase(f"example-{name}-title")), sentences(Phrase(f"example-{name}-about")), difficulty
        )
        for name, difficulty in EXAMPLES.items()
    ]


def example(name: str) -> Project:
    """Return the project of an example. Raises MotorcadeError."""
    if name not in EXAMPLES:
        raise MotorcadeError("no-example", name=name[:40])
    return open_text((resources.files(__package__) / "gallery" / f"{name}.motorcade.json").read_bytes())


def opening() -> Project:
    """Return the project that a first visit finds. Each block has an id, so that its words are known in advance."""
    # Its cars drive at once.
    return example("town")
