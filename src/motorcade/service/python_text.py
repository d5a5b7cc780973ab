"""The Python text beside the blocks: each from the other."""

from collections.abc import Iterator, Sequence
from difflib import get_close_matches

from motorcade.config.profile import built_in_profiles
from motorcade.errors import MotorcadeError
from motorcade.program.alignment import with_ids_of
from motorcade.program.blocks import blocks_of, program_of
from motorcade.program.diagnostics import TEXT, Fix, ProgramError, error
from motorcade.program.model import Program
from motorcade.program.python_reader import PythonProgram, read_python
from motorcade.program.python_writer import python_text, updated_text
from motorcade.program.step import Step
from motorcade.program.steps import RepeatStep, TogetherStep
from motorcade.service import messages
from motorcade.service.programs import diagnostics_in_all_languages, profile_named


def blocks_to_python(sent: messages.BlocksAndText) -> messages.PythonText:
    """Return the text of the blocks: the one that was sent, with its comments, where it can be read."""
    try:
        program = program_of(sent.leader, sent.followers, sent.profile)
    except ProgramError:
        return messages.PythonText(sent.text or python_text(Program([], profile=sent.profile)))
    try:
        text = updated_text(sent.text, program) if sent.text.strip() else python_text(program)
    except ProgramError as problem:
        return messages.PythonText(sent.text, [], diagnostics_in_all_languages(problem.diagnostics))
    read = read_python(text)
    return messages.PythonText(text, _places(read, program), diagnostics_in_all_languages(read.diagnostics))


def python_to_blocks(sent: messages.BlocksAndText) -> messages.PythonBlocks:
    """Return the blocks of the text."""
    try:
        read = read_python(sent.text)
        try:
            profile_named(read.program.profile)
        except MotorcadeError as problem:
            found = error("bad-profile", "profile", reason=problem)
            names = get_close_matches(read.program.profile, built_in_profiles(), 1)
            fixed = found.with_fixes(*(Fix(TEXT, f'"{name}"') for name in names))
            raise ProgramError(read.located([fixed])) from None
        leader, followers = blocks_of(with_ids_of(read.program, _sent_program(sent)))
    except ProgramError as problem:
        return messages.PythonBlocks(diagnostics=diagnostics_in_all_languages(problem.diagnostics))
    return messages.PythonBlocks(
        leader, followers, read.program.profile, diagnostics_in_all_languages(read.diagnostics)
    )


def _sent_program(sent: messages.BlocksAndText) -> Program:
    """Return the program of the blocks that were sent; one without steps where they make none."""
    try:
        return program_of(sent.leader, sent.followers, sent.profile)
    except ProgramError:
        return Program([])


def _places(read: PythonProgram, program: Program) -> list[messages.BlockPlace]:
    """Return where the blocks of ``program``, which the text makes, stand in it."""
    steps = program.followers.steps if program.followers else ()
    return [*_places_of(program.leader, "leader", read), *_places_of(steps, "followers.steps", read)]


def _places_of(steps: Sequence[Step], path: str, read: PythonProgram) -> Iterator[messages.BlockPlace]:
    for number, step in enumerate(steps):
        here = f"{path}[{number}]"
        if step.id is not None:
            yield messages.BlockPlace(*read.spans[here], step.id)
        if isinstance(step, RepeatStep):
            yield from _places_of(step.steps, f"{here}.{step.kind}.steps", read)
        elif isinstance(step, TogetherStep):
            yield from _places_of(step.steps, f"{here}.{step.kind}", read)
