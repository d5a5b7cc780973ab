"""A project's file: the program, and beside it the mat and what the blocks look like."""

import json
from typing import Any

import msgspec
from msgspec import Struct

from motorcade.program.blocks import Workspace, blocks_of, program_of
from motorcade.program.diagnostics import ProgramError
from motorcade.program.model import Program, program_from_dict, read_document
from motorcade.service.messages import RangeMm


class Project(Struct):
    """What the page works on."""

    leader: dict[str, Any]
    followers: dict[str, Any] | None = None
    profile: str = "classroom"
    mat: dict[str, Any] | None = None
    range_mm: RangeMm | None = None


class _View(Struct):
    range_mm: RangeMm | None = None


def project_text(project: Project) -> str:
    """The text of the project's file.

    Blocks that no program says yet are kept as well: their program has no steps.
    """
    text = _meaning(project.leader, project.followers, project.profile).as_json().removesuffix("\n}\n")
    view: dict[str, Any] = {"leader": project.leader, "followers": project.followers}
    if project.range_mm is not None:
        view["range_mm"] = project.range_mm
    beside = {"mat": project.mat, "view": view}
    for name, value in beside.items():
        if value is not None:
            # A line each: indented, a long row of blocks would be mostly spaces.
            text += f',\n "{name}": {json.dumps(value, ensure_ascii=False)}'
    return text + "\n}\n"


def opened(text: str | bytes) -> Project:
    """The Project in a file's text; its blocks stand as they were left, if they still say the program.

    Raises:
        ProgramError: the text is no project file, or more than blocks can say.
    """
    document = read_document(text)
    program = program_from_dict(document)
    view = document.get("view")
    leader, followers = _viewed(view, program) or blocks_of(program)
    return Project(leader, followers, program.profile, document.get("mat"), _range_mm(view))


def laid_out(program: Program) -> Project:
    """The Project of a program that was never blocks. Raises ProgramError: it is more than blocks can say."""
    return Project(*blocks_of(program), program.profile)


def _range_mm(view: Any) -> int | None:
    """How far infrared reached when the file was saved; None where it doesn't say, or nothing that can be."""
    try:
        return msgspec.convert(view, _View).range_mm
    except msgspec.ValidationError:
        return None


def _viewed(view: Any, program: Program) -> tuple[Workspace, Workspace | None] | None:
    """The workspaces in ``view``, where they say the program."""
    try:
        kept = msgspec.convert({**(view or {}), "profile": program.profile, "range_mm": None}, Project)
    except msgspec.ValidationError:
        return None
    if _meaning(kept.leader, kept.followers, kept.profile) != program:
        return None
    return kept.leader, kept.followers


def _meaning(leader: Workspace, followers: Workspace | None, profile: str) -> Program:
    """The program that the blocks say; one without steps where they say none yet."""
    try:
        return program_of(leader, followers, profile)
    except ProgramError:
        return Program([], profile=profile)
