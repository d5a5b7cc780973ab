"""What the page shows of a program: its words, which block each bit comes from, and when each word runs."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from msgspec import Struct, field

from motorcade.config.profile import Profile, built_in_profile, built_in_profiles
from motorcade.errors import MotorcadeError
from motorcade.program.blocks import program_of
from motorcade.program.compiler import Compiled, compile_program, length_ms
from motorcade.program.diagnostics import LANGUAGES, Diagnostic, ProgramError
from motorcade.program.model import Program
from motorcade.program.steps import RepeatStep, Step, TogetherStep
from motorcade.program.timing import MOST_PIECES
from motorcade.service.errors import MESSAGES, StudioError
from motorcade.words.formats import CONTROL, HEADER
from motorcade.words.image import words_to_bytes

# What waiting does is standing still, with the motor's own bits.
_FIELDS = {
    kind: [each.name for each in CONTROL.fields if each.name.startswith(prefix)]
    for kind, prefix in {"drive": "motor", "wait": "motor", "led": "led", "avoid": "avoid"}.items()
} | {"voice": ["voice"], "pir": ["pir"]}


class Blocks(Struct):
    """What both editors hold."""

    leader: dict[str, Any]
    followers: dict[str, Any] | None = None
    profile: str = "classroom"


class Word(Struct, omit_defaults=True):
    """A word, its fields, and the block that it comes from; ``fields_of`` says which fields come from other blocks."""

    hex: str
    part: str
    values: dict[str, int]
    block: str | None
    fields_of: dict[str, str] = {}


class Span(Struct):
    """When a word runs, counted from the beginning of its round."""

    word: int
    begin_ms: int
    end_ms: int


class Costliest(Struct):
    """The block that makes the most words."""

    block: str | None
    count: int


class Costs(Struct):
    """The costliest block of each editor; None where it makes no words."""

    leader: Costliest | None = None
    followers: Costliest | None = None


class Timeline(Struct):
    """When each word of the leader's and the followers' rounds runs."""

    leader: list[Span] = []
    followers: list[Span] = []


class Said(Struct):
    """A diagnostic; without a block it is about all of its editor."""

    code: str
    severity: str
    message: dict[str, str]
    path: str
    block: str | None
    editor: str | None


class Answer(Struct):
    """All that the page shows of a program; where it can't be compiled, the diagnostics say why."""

    diagnostics: list[Said]
    image: bytes | None = None
    dwell_ms: int = 0
    states: int = 0
    follower_words: int = 0
    most: int = MOST_PIECES
    costliest: Costs = field(default_factory=Costs)
    words: list[Word] = []
    timeline: Timeline = field(default_factory=Timeline)


def profile_named(name: str) -> Profile:
    """The built-in profile called ``name``. Raises StudioError."""
    try:
        return built_in_profile(name)
    except MotorcadeError:
        known = ", ".join(built_in_profiles())
        raise StudioError("unknown-profile", 404, name=name[:40], known=known) from None


def compiled_blocks(blocks: Blocks) -> Answer:
    """The Answer for what stands in the editors. Raises StudioError: there is no such profile."""
    profile = profile_named(blocks.profile)
    try:
        program = program_of(blocks.leader, blocks.followers, blocks.profile)
    except ProgramError as problem:
        return Answer(said(problem.diagnostics))
    compiled = compile_program(program, profile)
    told = program.followers.steps if program.followers else ()
    return Answer(
        diagnostics=said(compiled.diagnostics),
        image=words_to_bytes(compiled.words) if compiled.words else None,
        dwell_ms=compiled.dwell_ms,
        states=compiled.leader_states,
        follower_words=compiled.follower_words,
        costliest=Costs(
            _costliest(compiled, "too-many-states", "leader[", program.leader),
            _costliest(compiled, "too-many-words", "followers.steps[", told),
        ),
        words=_words(compiled, program),
        timeline=_timeline(compiled, profile),
    )


def said(diagnostics: Iterable[Diagnostic]) -> list[Said]:
    """The diagnostics in every language, and the editor that each is about."""
    return [
        Said(
            each.code,
            each.severity,
            {language: _sentence(each, language) for language in LANGUAGES},
            each.path,
            each.id,
            next((editor for editor in ("leader", "followers") if each.path.startswith(editor)), None),
        )
        for each in diagnostics
    ]


def _sentence(diagnostic: Diagnostic, language: str) -> str:
    if diagnostic.code in MESSAGES:
        return MESSAGES[diagnostic.code][language].format(**dict(diagnostic.arguments))
    return diagnostic.message(language)


def _words(compiled: Compiled, program: Program) -> list[Word]:
    if not compiled.words:
        return []
    header, *control = compiled.words
    words = [Word(f"{header:08x}", "header", HEADER.decode(header)._asdict(), None)]
    fields_of = dict(_fields_of_togethers(program.leader, "leader"))
    if program.followers:
        fields_of |= _fields_of_togethers(program.followers.steps, "followers.steps")
    for number, (word, (path, block)) in enumerate(zip(control, compiled.origins[1:], strict=True)):
        part = "leader" if number < compiled.leader_states else "followers"
        words.append(Word(f"{word:08x}", part, CONTROL.decode(word)._asdict(), block, fields_of.get(path, {})))
    return words


def _fields_of_togethers(steps: Sequence[Step], path: str) -> Iterator[tuple[str, dict[str, str]]]:
    """For the path of each together among ``steps`` the blocks that its words' fields come from."""
    for number, step in enumerate(steps):
        place = f"{path}[{number}]"
        if isinstance(step, RepeatStep):
            yield from _fields_of_togethers(step.steps, f"{place}.repeat.steps")
        elif isinstance(step, TogetherStep):
            yield place, {name: part.id for part in step.steps if part.id for name in _FIELDS[part.kind]}


def _costliest(compiled: Compiled, too_many: str, prefix: str, steps: Sequence[Step]) -> Costliest | None:
    """Which of ``steps``, whose paths begin with ``prefix``, makes the most words."""
    for each in compiled.diagnostics:
        if each.code == too_many:
            return Costliest(each.id, dict(each.arguments)["cost"])
    counts = Counter(
        int(path.removeprefix(prefix).partition("]")[0]) for path, _ in compiled.origins if path.startswith(prefix)
    )
    if not counts:
        return None
    ((number, count),) = counts.most_common(1)
    return Costliest(steps[number].id, count)


def _timeline(compiled: Compiled, profile: Profile) -> Timeline:
    leader = [length_ms(word, profile) for word in compiled.words[1 : 1 + compiled.leader_states]]
    followers = [compiled.dwell_ms] * (len(compiled.words) - 1 - len(leader))
    return Timeline(_spans(leader, 1), _spans(followers, 1 + len(leader)))


def _spans(lengths_ms: Sequence[int], first_word: int) -> list[Span]:
    spans, begin_ms = [], 0
    for number, duration_ms in enumerate(lengths_ms):
        spans.append(Span(first_word + number, begin_ms, begin_ms + duration_ms))
        begin_ms += duration_ms
    return spans
