"""Tables and sentences on a terminal: words, formats, diagnostics, progress."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from motorcade.cli.output import current_language, in_language, make_table, sentence_of, translated
from motorcade.config.profile import Profile
from motorcade.devices.motor import DIRECTIONS
from motorcade.engine.events import NEXT_WORD
from motorcade.errors import Phrase
from motorcade.locales import catalogue
from motorcade.program.steps import SIMPLE_KINDS
from motorcade.words.field import Field, WordFormat
from motorcade.words.flow import (
    ALWAYS,
    CHANCE,
    CONDITIONS,
    COUNT,
    COUNTER,
    DECIDES,
    IN_TURN,
    OBSTACLE,
    OPS,
    RETURN,
    TAGGED,
    TELL,
)
from motorcade.words.formats import CONTROL, FLOW, HEADER, STATE, fingerprint
from motorcade.words.image import format_at, parse_image

_COLOURS = ("cyan", "yellow", "green", "magenta", "blue", "red")


def coloured_bits(word: int, word_format: WordFormat, before: str = "") -> Text:
    """Write the 32 bits after the text ``before``, with a space and another colour for each field."""
    text = Text(before)
    for number, field in enumerate(word_format.fields):
        raw = word >> field.low & field.raw_mask
        text.append(f"{raw:0{field.width}b}", style=_COLOURS[number % len(_COLOURS)])
        text.append(" ")
    text.rstrip()
    return text


def describe_header(word: int, profile: Profile) -> str:
    """Describe a header word in a phrase."""
    values = HEADER.decode(word)
    counts = {"leader": values.leader_states, "followers": values.follower_words}
    if values.dwell:
        seconds = profile.dwell_ms[values.dwell.bit_length() - 1] / 1000
        content = translated("header-content-with-dwell", seconds=seconds, **counts)
    else:
        content = translated("header-content", **counts)
    if values.reserved & TAGGED:
        content += translated("words-are-tagged")
    if values.reserved & DECIDES:
        content += translated("leader-decides")
    return content


def describe_state(word: int, profile: Profile) -> str:
    """Describe in a phrase a state of a leader that decides: what it does, and the condition that ends it."""
    values = STATE.decode(word)
    content = describe_control(word, profile)
    if values.until == ALWAYS:
        return content
    condition = _describe_condition(values.until, values.until_level, 0, 0, values.until_not, profile)
    return content + translated("state-until", condition=condition)


def describe_flow(word: int, profile: Profile) -> str:
    """Describe in a phrase what a flow word does."""
    values = FLOW.decode(word)
    op = dict(OPS)[values.op]
    if values.op == RETURN:
        return translated("flow-return")
    if values.op == COUNT:
        return translated(f"flow-count-{values.level}", counter=values.counter + 1, value=values.value)
    if values.op == TELL and values.target == IN_TURN:
        return translated("flow-tell-in-turn" if values.value else "flow-tell-all-in-turn", count=values.value)
    # The words of a role are numbered from 1, as in the column before.
    content = translated(f"flow-{op}", number=values.target + 1)
    if values.op == TELL or values.condition == ALWAYS:
        return content
    asked = (values.condition, values.level, values.counter, values.value, values.if_not)
    return content + translated("flow-if", condition=_describe_condition(*asked, profile))


def _describe_condition(condition: int, level: int, counter: int, value: int, is_not: int, profile: Profile) -> str:
    if condition == OBSTACLE:
        text = translated("condition-obstacle", radius_mm=profile.avoid_radii_mm[level])
    elif condition == COUNTER:
        text = translated(f"condition-counter-{level}", counter=counter + 1, value=value)
    elif condition == CHANCE:
        text = translated("condition-chance", percent=round(value / 2.56))
    else:
        text = translated(f"condition-{dict(CONDITIONS)[condition]}-{level}")
    return translated("condition-not", condition=text) if is_not else text


def describe_control(word: int, profile: Profile) -> str:
    """Describe in a phrase what a control word makes a car of ``profile`` do."""
    values = CONTROL.decode(word)
    seconds = [duration_ms / 1000 for duration_ms in profile.durations_ms]
    parts = []
    if values.motor_enable and values.motor_speed == 0:
        parts.append(translated("does-stand-still", seconds=seconds[values.motor_duration]))
    elif values.motor_enable:
        if values.motor_direction in (1, 2):
            speed = f"{profile.turn_rates_deg_s[values.motor_speed]}°/s"
        else:
            speed = f"{profile.speeds_mm_s[values.motor_speed]} mm/s"
        direction = DIRECTIONS[values.motor_direction]
        parts.append(translated(f"does-{direction}", speed=speed, seconds=seconds[values.motor_duration]))
    if values.led_which or values.led_duration:
        parts.append(translated("does-led", led=values.led_which, seconds=seconds[values.led_duration]))
    if values.avoid_enable:
        radius_mm = profile.avoid_radii_mm[values.avoid_radius]
        parts.append(translated("does-avoid", radius_mm=radius_mm, seconds=seconds[values.avoid_duration]))
    companions = (kind.kind for kind in SIMPLE_KINDS if kind.accompanies)
    parts += [translated(f"does-{name}") for name in companions if getattr(values, name)]
    return translated("comma").join(parts) or translated("does-nothing")


_DESCRIBE = {"control": describe_control, "state": describe_state, "flow": describe_flow}
# What a car does with the word of an event.
_DONE_WITH_WORD = {"state": describe_state, "start": describe_control, "flow": describe_flow}


def describe_event(kind: str, word: int, detail: int | str, profile: Profile) -> str:
    """Say in a sentence what a car did.

    Args:
        kind: of `motorcade.engine.events.KINDS`, or image: one was stored.
        word: the event's word; of an image its size in bytes.
        detail: ``other`` of the event, for a lost frame the reason.
    """
    details: dict[str, object] = {"detail": detail, "count": word}
    if kind in _DONE_WITH_WORD:
        details["does"] = _DONE_WITH_WORD[kind](word, profile)
    if kind == "lost":
        details["detail"] = Phrase(f"lost-{detail}")
    if kind in ("state", "flow"):
        following, index = divmod(int(detail), NEXT_WORD)
        # As in a table of words, the leader's are numbered from 1.
        details |= {"number": index + 1, "next": following + 1}
    return translated(f"car-{kind}", **details)


def words_table(words: Sequence[int], profile: Profile) -> Table:
    """Make a table of the words of an image: what each means, and its bits by field. Raises ImageError."""
    image = parse_image(tuple(words))
    rows = []
    for number, word in enumerate(words):
        role = "follower"
        word_format = format_at(number, word, words[0])
        if number == 0:
            role = "header"
            content = describe_header(word, profile)
        elif number <= len(image.leader):
            role = "leader"
            content = _DESCRIBE[word_format.name](word, profile)
        else:
            content = describe_control(word, profile) + _describe_infrared(word)
        bits = coloured_bits(word, word_format, f"{content}\n")
        rows.append((number, translated(f"role-{role}"), f"{word:08X}", bits))
    columns = ("number", "for", "hexadecimal", "content")
    title = translated("words-table-title", count=len(words), bytes=len(words) * 4)
    caption = translated("words-table-caption", fields=", ".join(field.name for field in CONTROL.fields))
    style = {"title": title, "caption": caption, "show_lines": True}
    return make_table(columns, rows, right=["number"], unbroken=columns[:3], **style)


def _describe_infrared(word: int) -> str:
    values = CONTROL.decode(word)
    content = ""
    if not values.accept_ir:
        content = translated("word-makes-deaf")
    if values.forward:
        content += translated("word-passed-on")
    return content


def fields_table(word: int, word_format: WordFormat, warnings: Iterable[Phrase]) -> Table:
    """Make a table of the fields of one word: bits, raw value, meaning."""
    lines = [translated("warning-line", code=warning.key, warning=warning) for warning in warnings]
    title = translated("fields-table-title", format=word_format.name, word=word)
    columns = ("bits", "field", "raw", "meaning", "source")
    rows = [
        (_bits(field), field.name, word >> field.low & field.raw_mask, _meaning(word_format, field), field.source)
        for field in word_format.fields
    ]
    return make_table(columns, rows, right=("bits", "raw"), title=title, caption="\n".join(lines) or None)


def format_table(word_format: WordFormat) -> Table:
    """Make a table of the fields of a format: bits, allowed values with their unit, meaning."""
    title = translated("format-table-title", format=word_format.name, fingerprint=fingerprint_text(word_format))
    columns = ("bits", "field", "allowed", "meaning", "source")
    rows = [
        (
            _bits(field),
            field.name,
            f"{sentence_of(field.allowed)} {field.unit}".rstrip(),
            _meaning(word_format, field),
            field.source,
        )
        for field in word_format.fields
    ]
    return make_table(columns, rows, right=["bits"], unbroken=("bits", "field"), title=title)


def fingerprint_text(word_format: WordFormat) -> str:
    """Return the fingerprint as exported files have it: ``0x`` and 8 digits."""
    return f"0x{fingerprint(word_format):08X}"


def _meaning(word_format: WordFormat, field: Field) -> str:
    meaning: str = catalogue(current_language())["meanings"].get(f"{word_format.name}.{field.name}", field.meaning)
    return meaning


def _bits(field: Field) -> str:
    if field.width == 1:
        return str(field.high)
    return f"{field.high}-{field.low}"


@contextmanager
def progress_bar(doing: str, total: int) -> Iterator[Callable[[int], None]]:
    """Draw a bar on standard error while the block runs; call the yielded function with what is done of ``total``.

    ``doing`` is the text "progress-…" of the catalogue, such as ``"sent"``.
    """
    columns = (TextColumn(translated(f"progress-{doing}")), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task(doing, total=total)
        yield lambda done: progress.update(task, completed=done)


@contextmanager
def drawing_texts() -> Iterator[None]:
    """Draw pictures in the current language while the block runs, or in English where no font has its letters."""
    from motorcade.runs.drawing import pictures_in

    with pictures_in(current_language()) as language, in_language(language):
        yield
