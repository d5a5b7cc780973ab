"""Compile and decompile the page's programs; make Python text and blocks of each other; list profiles."""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import fields
from difflib import get_close_matches
from math import gcd
from typing import Any, Literal

from motorcade.config.files import raised_as
from motorcade.config.profile import built_in_profile, built_in_profiles
from motorcade.errors import MotorcadeError, Phrase
from motorcade.locales import FIRST, catalogue, languages
from motorcade.program import diagnostics as program_diagnostics
from motorcade.program.blocks import MOST_DEEP, blocks_of, field_value
from motorcade.program.blocks_reader import holder_of, program_of
from motorcade.program.compiler import Compiled, compile_program
from motorcade.program.decompiler import DecompileError, decompile
from motorcade.program.diagnostics import TEXT, Fix, ProgramError, error
from motorcade.program.model import Program, placed_steps, with_ids_of
from motorcade.program.parts import MOST_PIECES, word_fields
from motorcade.program.python_reader import read_python
from motorcade.program.python_writer import python_text, updated_text
from motorcade.program.reactions import parts_at_once
from motorcade.program.steps import SIMPLE_KINDS, RepeatStep, Step, TogetherStep, own_fields
from motorcade.service import messages
from motorcade.service.documents import project_of, whole_program
from motorcade.words.packing import bytes_to_words, words_to_bytes

# The sentence of an error in a file names at most so many diagnostics; the others often follow from the first ones.
_MOST_SHOWN = 3
_EDITORS: tuple[Literal["leader", "followers"], ...] = ("leader", "followers")
# Errors of the whole program: without the block that they name, it would be another one.
_TOO_MANY = ("too-many-states", "too-many-words")
# The fields for which a button has words of its own; of others it says the value alone.
_FIXES = (
    *("accept_ir", "behind", "counter", "delete", "dwell_seconds"),
    *("function", "seconds", "tagged", "text", "times"),
)
# What a block around the wrong one, or the followers' hat, decides.
_SETTINGS = ("accept_ir", "dwell_seconds", "tagged")
# The fields of steps, by whose names the sentences of a file's errors tell where they are.
_FIELD_NAMES = {field.name for kind in (*SIMPLE_KINDS, RepeatStep) for field in own_fields(kind)}
# The fields of the control word that a step of each kind fills.
_FIELDS = {kind.kind: word_fields(kind) for kind in SIMPLE_KINDS}


def profile_figures() -> list[messages.ProfileFigures]:
    """Return the figures of all built-in profiles."""
    figures = []
    for profile in map(built_in_profile, built_in_profiles()):
        step = gcd(*profile.durations_ms) / 1000
        most = MOST_PIECES * profile.durations_ms[-1] / 1000
        values = {field.name: getattr(profile, field.name) for field in fields(profile)}
        seconds = messages.Seconds(0, step, most)
        figures.append(messages.ProfileFigures(**values, title=_title(profile.name), seconds=seconds))
    return figures


def _title(profile: str) -> messages.Sentence:
    """Return what people call the cars of a profile: its name where the catalogue has no other."""
    if f"kind-{profile}" not in catalogue(FIRST)["phrases"]:
        return dict.fromkeys(languages(), profile)
    return messages.sentences(Phrase(f"kind-{profile}"))


def decompile_image(image: bytes) -> messages.Project:
    """Return a project whose blocks compile to an image. Raises MotorcadeError where there is none."""
    with raised_as("not-decompiled", DecompileError):
        return project_of(decompile(bytes_to_words(image)))


def compile_blocks(blocks: messages.Blocks) -> messages.CompiledBlocks:
    """Compile the blocks of both editors; blocks with errors are left out, so that the others have words.

    Raises MotorcadeError where there is no such profile.
    """
    profile = built_in_profile(blocks.profile)
    sorting = _Sorting(blocks)
    answer = messages.CompiledBlocks([])
    if program := sorting.read():
        compiled = compile_program(program, profile)
        answer = _answer(compiled, program)
        if sorting.leave_out(compiled.diagnostics) and (program := sorting.read()):
            compiled = compile_program(program, profile)
            sorting.leave_out(compiled.diagnostics)
            answer.words = _words(compiled, program)
            answer.counters = list(compiled.counters)
    answer.diagnostics = diagnostics_in_all_languages(sorting.diagnostics.values(), blocks.followers)
    answer.left_out = sorted(sorting.left_out)
    if sorting.left_out:
        answer.image = None
    return answer


class _Sorting:
    """What is wrong with the blocks of both editors, and what is left of them.

    Attributes:
        diagnostics: each error once, and the warnings of the whole program.
        left_out: the ids of the blocks that have errors.
    """

    def __init__(self, blocks: messages.Blocks) -> None:
        self.diagnostics: dict[tuple[object, ...], program_diagnostics.Diagnostic] = {}
        self.left_out: set[str] = set()
        self._blocks = blocks

    def read(self) -> Program | None:
        """Return the program of the blocks that are left, without those that make none; None where nothing helps."""
        blocks = self._blocks
        # A block may be wrong only because those inside it are left out.
        for _ in range(MOST_DEEP):
            try:
                return program_of(blocks.leader, blocks.followers, blocks.profile, self.left_out)
            except ProgramError as problem:
                if not self.leave_out(problem.diagnostics):
                    return None
        return None

    def leave_out(self, found: Iterable[program_diagnostics.Diagnostic]) -> bool:
        """Note what is wrong, and leave out the blocks that it names; return whether there are any more of them."""
        wrong = set()
        for diagnostic in found:
            is_error = diagnostic.severity == "error"
            # A warning of what is left is not one of the whole program.
            if is_error or not self.left_out:
                key = (diagnostic.code, diagnostic.id or diagnostic.path, str(diagnostic.details))
                self.diagnostics.setdefault(key, diagnostic)
            if is_error and diagnostic.id and diagnostic.code not in _TOO_MANY:
                wrong.add(diagnostic.id)
        is_more = not wrong <= self.left_out
        self.left_out |= wrong
        return is_more


def _answer(compiled: Compiled, program: Program) -> messages.CompiledBlocks:
    followers_steps: Sequence[Step] = ()
    if program.followers:
        followers_steps = program.followers.steps
    return messages.CompiledBlocks(
        diagnostics=[],
        image=words_to_bytes(compiled.words) if compiled.words else None,
        dwell_ms=compiled.dwell_ms,
        tagged=compiled.tagged,
        states=compiled.leader_states,
        follower_words=compiled.follower_words,
        costliest=messages.Costs(
            _costliest(compiled, "too-many-states", "leader[", program.leader),
            _costliest(compiled, "too-many-words", "followers.steps[", followers_steps),
        ),
        words=_words(compiled, program),
        counters=list(compiled.counters),
    )


def error_answer(problem: MotorcadeError) -> messages.ErrorAnswer:
    """Return the answer for an error; for a ProgramError with its diagnostics and the code of the first."""
    if isinstance(problem, ProgramError):
        first = problem.diagnostics[:_MOST_SHOWN]
        sentence = {
            language: "\n".join(
                f"{_place(diagnostic, language)}{diagnostic.sentence(language)}" for diagnostic in first
            )
            for language in languages()
        }
        return messages.ErrorAnswer(first[0].code, {}, sentence, diagnostics_in_all_languages(problem.diagnostics))
    return messages.ErrorAnswer(**problem.to_dict("page"))


def _place(diagnostic: program_diagnostics.Diagnostic, language: str) -> str:
    """Return where a diagnostic of a file is, in words: ``leader[2].repeat.steps[0].drive.speed`` is 'Leader, step 3.1,
    speed: '; nothing for the whole file.
    """
    numbers = ".".join(str(int(number) + 1) for number in re.findall(r"\[(\d+)\]", diagnostic.path))
    editor = next((editor for editor in _EDITORS if diagnostic.path.startswith(editor)), None)
    if editor is None:
        return f"{diagnostic.path}: ".removeprefix(": ")
    place = Phrase(f"place-{editor}")
    if numbers:
        place = Phrase("place-step", editor=place, number=numbers)
    last = diagnostic.path.rpartition(".")[2]
    if last in _FIELD_NAMES:
        place = Phrase("place-field", step=place, field=Phrase(f"field-{last}"))
    return Phrase("place-before", place=place).sentence(language)


def diagnostics_in_all_languages(
    diagnostics: Iterable[program_diagnostics.Diagnostic], followers: Any = None
) -> list[messages.Diagnostic]:
    """Return the diagnostics in every language, each with the editor that it concerns.

    A fix of the followers' settings names its block where ``followers``, the state of their workspace, is given.
    """
    found = []
    for diagnostic in diagnostics:
        path = diagnostic.path
        block = diagnostic.id
        editor = next((editor for editor in _EDITORS if path.startswith(editor)), None)
        settings = None
        if editor == "followers":
            settings = followers
        found.append(
            messages.Diagnostic(
                diagnostic.code,
                diagnostic.severity,
                {language: diagnostic.sentence(language, "page") for language in languages()},
                path,
                block,
                editor,
                _text_place(diagnostic.span),
                [_fix(fix, block, settings) for fix in diagnostic.fixes],
            )
        )
    return found


def _text_place(span: program_diagnostics.Span | None) -> messages.TextPlace | None:
    return span and messages.TextPlace(*span)


def _fix(fix: program_diagnostics.Fix, block: str | None, followers: Any) -> messages.Fix:
    """Return a fix of ``block`` for the page; of ``followers``, their workspace, it may fix another block."""
    holder = None
    if followers is not None and fix.field in _SETTINGS:
        holder = holder_of(followers, block, fix.field)
    name, value = field_value(fix.field, fix.value, holder is not None and "TAGGED" in holder.get("fields", {}))
    shown = str(value)
    if isinstance(value, float):
        shown = f"{value:g}"
    what = "value"
    if fix.field in _FIXES:
        what = fix.field
    if fix.field == program_diagnostics.TEXT:
        shown = shown.strip(" ,\n") or shown
        if not shown:
            what = "delete"
        elif "\n" in shown:
            what = "lines"
            shown = shown.splitlines()[0]
        elif fix.span and fix.span[:2] == fix.span[2:]:
            what = "add"
    elif fix.value is True:
        what = "listen"
    sentence = messages.sentences(Phrase(f"fix-{what}", value=shown))
    block = None
    if holder:
        block = holder.get("id")
    return messages.Fix(name, value, sentence, block, _text_place(fix.span))


def _words(compiled: Compiled, program: Program) -> list[messages.Word]:
    if not compiled.words:
        return []
    header, *control = compiled.words
    words = [messages.Word(f"{header:08x}", "header", None)]
    fields_of: dict[str, dict[str, str]] = {}
    for path, step in placed_steps(program):
        if isinstance(step, TogetherStep):
            fields_of[path] = {name: part.id for part in step.steps if part.id for name in _fields_of(part)}
    for number, (word, (path, block)) in enumerate(zip(control, compiled.origins[1:], strict=True)):
        part: Literal["leader", "followers"] = "followers"
        if number < compiled.leader_states:
            part = "leader"
        words.append(messages.Word(f"{word:08x}", part, block, fields_of.get(path, {})))
    return words


def _fields_of(part: Step) -> list[str]:
    """Return the fields of a control word that a part of a together fills."""
    return [name for beside in parts_at_once(part) for name in _FIELDS[beside.kind]]


def _costliest(compiled: Compiled, too_many: str, prefix: str, steps: Sequence[Step]) -> messages.Costliest | None:
    """Return the one of ``steps`` that makes the most words; the paths of these steps begin with ``prefix``."""
    for diagnostic in compiled.diagnostics:
        if diagnostic.code == too_many:
            return messages.Costliest(diagnostic.id, diagnostic.details["cost"])
    counts = Counter[int]()
    for path, _ in compiled.origins:
        if path.startswith(prefix):
            counts[int(path.removeprefix(prefix).partition("]")[0])] += 1
    if not counts:
        return None
    ((number, count),) = counts.most_common(1)
    return messages.Costliest(steps[number].id, count)


def blocks_to_python(sent: messages.BlocksAndText) -> messages.PythonText:
    """Return the text of the blocks: the one that was sent, with its comments, where it can be read."""
    try:
        program = program_of(sent.leader, sent.followers, sent.profile)
    except ProgramError:
        return messages.PythonText(sent.text or python_text(Program([], profile=sent.profile)))
    try:
        if sent.text.strip():
            text = updated_text(sent.text, program)
        else:
            text = python_text(program)
    except ProgramError as problem:
        return messages.PythonText(sent.text, [], diagnostics_in_all_languages(problem.diagnostics))
    read = read_python(text)
    places = []
    for path, step in placed_steps(program):
        if step.id is not None:
            places.append(messages.BlockPlace(*read.spans[path], step.id))
    return messages.PythonText(text, places, diagnostics_in_all_languages(read.diagnostics))


def python_to_blocks(sent: messages.BlocksAndText) -> messages.PythonBlocks:
    """Return the blocks of the text."""
    try:
        read = read_python(sent.text)
        try:
            built_in_profile(read.program.profile)
        except MotorcadeError as problem:
            found = error("bad-profile", "profile", reason=problem)
            names = get_close_matches(read.program.profile, built_in_profiles(), 1)
            fixed = found.with_fixes(*(Fix(TEXT, f'"{name}"') for name in names))
            raise ProgramError(read.located([fixed])) from None
        before = whole_program(sent)
        leader, followers = blocks_of(with_ids_of(read.program, before))
    except ProgramError as problem:
        return messages.PythonBlocks(diagnostics=diagnostics_in_all_languages(problem.diagnostics))
    return messages.PythonBlocks(
        leader, followers, read.program.profile, diagnostics_in_all_languages(read.diagnostics)
    )
