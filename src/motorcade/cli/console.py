"""What the command line shows on a terminal: words and diagnostics, as tables and sentences."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from motorcade.config.profile import Profile
from motorcade.errors import Phrase
from motorcade.locales import command_line_text
from motorcade.program.diagnostics import Diagnostic
from motorcade.words.field import WordFormat
from motorcade.words.formats import CONTROL, HEADER
from motorcade.words.image import parse_image

_DIRECTIONS = ("forward", "left", "right", "random")
_COLOURS = ("cyan", "yellow", "green", "magenta", "blue", "red")


def coloured_bits(word: int, word_format: WordFormat, before: str = "") -> Text:
    """The 32 bits, fields apart and each in a colour of its own, behind the text ``before``."""
    text = Text(before)
    for number, field in enumerate(word_format.fields):
        raw = word >> field.low & field.raw_mask
        text.append(f"{raw:0{field.width}b}", style=_COLOURS[number % len(_COLOURS)])
        text.append(" ")
    text.rstrip()
    return text


def describe_header(word: int, profile: Profile) -> str:
    """A header word in a phrase."""
    values = HEADER.decode(word)
    phrase = f"{values.leader_states} for the leader, {values.follower_words} for followers"
    if values.dwell:
        phrase += f", {profile.dwell_ms[values.dwell.bit_length() - 1] / 1000:g} s each"
    return phrase


def describe_control(word: int, profile: Profile) -> str:
    """What a control word makes a car of ``profile`` do, in a phrase."""
    values = CONTROL.decode(word)
    seconds = [f"{duration / 1000:g} s" for duration in profile.durations_ms]
    parts = []
    if values.motor_enable and values.motor_speed == 0:
        parts.append(f"stand still {seconds[values.motor_duration]}")
    elif values.motor_enable:
        turns = values.motor_direction in (1, 2)
        speed = (
            f"{profile.turn_rates_deg_s[values.motor_speed]}°/s"
            if turns
            else f"{profile.speeds_mm_s[values.motor_speed]} mm/s"
        )
        parts.append(f"{_DIRECTIONS[values.motor_direction]} {speed} {seconds[values.motor_duration]}")
    if values.led_which or values.led_duration:
        parts.append(f"LED {values.led_which} {seconds[values.led_duration]}")
    if values.avoid_enable:
        parts.append(f"avoid {profile.avoid_radii_mm[values.avoid_radius]} mm {seconds[values.avoid_duration]}")
    parts.extend(name for name, bit in (("voice", values.voice), ("PIR", values.pir)) if bit)
    return ", ".join(parts) or "nothing"


def words_table(words: Sequence[int], profile: Profile) -> Table:
    """The words of an image: what each says, and its bits field by field. Raises ImageError."""
    image = parse_image(tuple(words))
    table = Table(title=f"{len(words)} words, {len(words) * 4} bytes", title_justify="left", show_lines=True)
    table.caption = "A control word's bits, in order: " + ", ".join(field.name for field in CONTROL.fields)
    table.caption_justify = "left"
    table.add_column("#", justify="right", no_wrap=True)
    table.add_column("for", no_wrap=True)
    table.add_column("hex", no_wrap=True)
    table.add_column("what it says, and its bits")
    header = Text(describe_header(words[0], profile) + "\n") + coloured_bits(words[0], HEADER)
    table.add_row("0", "header", f"{words[0]:08X}", header)
    for number, word in enumerate(words[1:], start=1):
        leads = number <= len(image.leader)
        says = describe_control(word, profile) + ("" if leads else _describe_infrared(word))
        content = Text(says + "\n") + coloured_bits(word, CONTROL)
        table.add_row(str(number), "leader" if leads else "follower", f"{word:08X}", content)
    return table


def _describe_infrared(word: int) -> str:
    values = CONTROL.decode(word)
    return ("" if values.accept_ir else "; deaf meanwhile") + ("; passed on" if values.forward else "")


def print_diagnostics(console: Console, diagnostics: Iterable[Diagnostic], language: str) -> None:
    """One line each: place, severity, sentence."""
    for each in diagnostics:
        line = Text()
        line.append(f"{each.path}: " if each.path else "")
        line.append(
            command_line_text(each.severity, language), style="bold red" if each.severity == "error" else "bold yellow"
        )
        line.append(f" {each.code}: {each.message(language)}")
        console.print(line, soft_wrap=True)


def fields_table(word: int, word_format: WordFormat, warnings: Iterable[Phrase]) -> Table:
    """One word's fields: bits, raw value, meaning."""
    caption = "\n".join(f"warning: {sentence}" for sentence in warnings) or None
    title = f"{word_format.name} word {word} = 0x{word:08X}"
    table = Table(title=title, title_justify="left", caption=caption, caption_justify="left")
    table.add_column("bits", justify="right")
    table.add_column("field")
    table.add_column("raw", justify="right")
    table.add_column("meaning")
    table.add_column("source")
    for field in word_format.fields:
        bits = str(field.high) if field.width == 1 else f"{field.high}-{field.low}"
        table.add_row(bits, field.name, str(word >> field.low & field.raw_mask), field.meaning, field.source)
    return table


def format_table(word_format: WordFormat, fingerprint: str) -> Table:
    """A format's fields: bits, allowed values with their unit, meaning."""
    table = Table(title=f"{word_format.name}, fingerprint {fingerprint}", title_justify="left")
    table.add_column("bits", justify="right", no_wrap=True)
    table.add_column("field", no_wrap=True)
    for name in ("allowed", "meaning", "source"):
        table.add_column(name)
    for field in word_format.fields:
        bits = str(field.high) if field.width == 1 else f"{field.high}-{field.low}"
        allowed = f"{field.allowed} {field.unit}".rstrip()
        table.add_row(bits, *map(Text, (field.name, allowed, field.meaning, field.source)))
    return table


@contextmanager
def progress_bar(verb: str, total: int) -> Iterator[Callable[[int], None]]:
    """A bar on standard error while it takes more than a moment; call the yielded function with what is done."""
    columns = (TextColumn(verb), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task(verb, total=total)
        yield lambda done: progress.update(task, completed=done)
