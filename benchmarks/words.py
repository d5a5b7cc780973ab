"""Compare Motorcade's words with other libraries, one word at a time. Run ``python benchmarks/words.py``.

Each library gets the input that it takes (an integer, or its four bytes) and a format built from Motorcade's table of
fields. Contestants take turns, so that a machine that is slow for a while is slow for all of them. Figures are
medians of processor time.
"""

import gc
from collections.abc import Callable, Iterable
from statistics import median
from time import thread_time_ns
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from timing import has_peer

from motorcade.words.field import Field
from motorcade.words.formats import CONTROL
from motorcade.words.positions import UNUSED_BITS

TURNS = 31
SCALAR_WORDS = 4_000
DECODE_GOAL = 1.2
ENCODE_GOAL = 1.3
PEERS = ("bitstruct", "cantools", "construct")

FIELDS = CONTROL.fields
# The fields that a word of an image may set. Who encodes one names these, and what is below them is 0.
SET_FIELDS = tuple(field for field in FIELDS if not field.word_mask & UNUSED_BITS)
SHIFTED_OUT = ", ".join(f"{field.name!r}: word >> {field.low} & {field.raw_mask}" for field in FIELDS)
NAMES = [field.name for field in SET_FIELDS]
KEYWORDS = ", ".join(f"{name}={name}" for name in NAMES)
DICT = "{" + ", ".join(f"{name!r}: {name}" for name in NAMES) + "}"
SHIFTED_IN = " | ".join(f"{field.name} << {field.low}" for field in SET_FIELDS)
CHECKED = " or ".join(f"not 0 <= {field.name} <= {field.raw_mask}" for field in SET_FIELDS)

Contestants = dict[str, Callable[[], object]]


def medians_ns(contestants: Contestants, words: int) -> dict[str, float]:
    """Median processor time of each contestant in ns a word."""
    times_ns: dict[str, list[int]] = {name: [] for name in contestants}
    for run in contestants.values():
        run()
    gc.disable()
    for _ in range(TURNS):
        for name, run in contestants.items():
            begin_ns = thread_time_ns()
            made = run()
            times_ns[name].append(thread_time_ns() - begin_ns)
            # Free the result outside the measured time, and before the next contestant makes its own.
            del made
    gc.enable()
    return {name: median(each) / words for name, each in times_ns.items()}


def loop(names: str, expression: str, rows: list[Any], **space: Any) -> Callable[[], None]:
    """Return a loop that runs ``expression`` for each of ``rows``, without any call but the measured one."""
    exec(f"def run(rows):\n    for {names} in rows:\n        {expression}", space)
    return lambda: space["run"](rows)


def bitstruct_format(fields: tuple[Field, ...]) -> str:
    """Return the format of these fields, the first ones of a word; what is below them is padding."""
    padding = f"p{fields[-1].low}" if fields[-1].low else ""
    return "".join(f"u{field.width}" for field in fields) + padding


def bitstruct_codecs(fields: tuple[Field, ...]) -> tuple[Any, Any]:
    """Return bitstruct's codec of a dictionary, and that of values in order."""
    import bitstruct.c

    text = bitstruct_format(fields)
    return bitstruct.c.compile(text, [field.name for field in fields]), bitstruct.c.compile(text)


def construct_format(fields: tuple[Field, ...]) -> Any:
    import construct

    members = [field.name / construct.BitsInteger(field.width) for field in fields]
    return construct.BitStruct(*members, construct.Padding(fields[-1].low))


def cantools_message(fields: tuple[Field, ...]) -> Any:
    from cantools.database import Message
    from cantools.database.can import Signal

    signals = [
        # DBC counts a big-endian signal's first bit from each byte's own bit 0.
        Signal(field.name, (31 - field.high) // 8 * 8 + field.high % 8, field.width, byte_order="big_endian")
        for field in fields
    ]
    return Message(1, "control", 4, signals)


def scalar_decoders(words: list[int], peers: set[str]) -> Contestants:
    images = [word.to_bytes(4, "big") for word in words]
    shifts = eval("lambda word: {" + SHIFTED_OUT + "}")
    made: Contestants = {
        "Motorcade": loop("word", "decode(word)", words, decode=CONTROL.decode),
        "Motorcade, from bytes": loop(
            "data", "decode(read(data, 'big'))", images, decode=CONTROL.decode, read=int.from_bytes
        ),
        "shifts by hand, dict": loop("word", "shifts(word)", words, shifts=shifts),
    }
    if "bitstruct" in peers:
        named, plain = bitstruct_codecs(FIELDS)
        made["bitstruct C, dict"] = loop("data", "unpack(data)", images, unpack=named.unpack)
        made["bitstruct C, tuple"] = loop("data", "unpack(data)", images, unpack=plain.unpack)
    if "cantools" in peers:
        decoding = "decode(data, decode_choices=False, scaling=False)"
        made["cantools"] = loop("data", decoding, images, decode=cantools_message(FIELDS).decode)
    if "construct" in peers:
        made["construct"] = loop("data", "parse(data)", images, parse=construct_format(FIELDS).parse)
    return made


def scalar_encoders(words: list[int], peers: set[str]) -> Contestants:
    values = [tuple(CONTROL.decode(word))[: len(NAMES)] for word in words]
    dicts = [dict(zip(NAMES, fields, strict=True)) for fields in values]
    names = ", ".join(NAMES)
    space: dict[str, Any] = {}
    exec(f"def by_hand({names}):\n    if {CHECKED}: raise ValueError\n    return {SHIFTED_IN}", space)
    made: Contestants = {
        "Motorcade": loop(names, f"encode({KEYWORDS})", values, encode=CONTROL.encode),
        "Motorcade, **dict": loop("fields", "encode(**fields)", dicts, encode=CONTROL.encode),
        "shifts by hand, checked": loop(names, f"by_hand({KEYWORDS})", values, by_hand=space["by_hand"]),
    }
    if "bitstruct" in peers:
        named, plain = bitstruct_codecs(SET_FIELDS)
        made["bitstruct C, dict"] = loop(names, f"pack({DICT})", values, pack=named.pack)
        made["bitstruct C, ready dict"] = loop("fields", "pack(fields)", dicts, pack=named.pack)
        made["bitstruct C, values in order"] = loop(names, f"pack({names})", values, pack=plain.pack)
    if "cantools" in peers:
        encode = cantools_message(SET_FIELDS).encode
        made["cantools"] = loop(names, f"encode({DICT}, scaling=False)", values, encode=encode)
    if "construct" in peers:
        made["construct"] = loop(names, f"build({DICT})", values, build=construct_format(SET_FIELDS).build)
    return made


def result(met: bool) -> str:
    return "[green]met[/]" if met else "[red]missed[/]"


def add_scalar_rows(
    table: Table, task: str, contestants: Contestants, pairs: Iterable[tuple[str, str, float | None]]
) -> None:
    times_ns = medians_ns(contestants, SCALAR_WORDS)
    for ours, peer, goal in pairs:
        if peer not in contestants:
            continue
        ratio = times_ns[ours] / times_ns[peer]
        marks = (f"≤ {goal:g}", result(ratio <= goal)) if goal else ("", "")
        table.add_row(task, ours, f"{times_ns[ours]:.0f}", peer, f"{times_ns[peer]:.0f}", f"{ratio:.2f}", *marks)
    table.add_section()


def scalar_table(words: list[int], installed: set[str]) -> Table:
    table = Table(
        "task", "ours", "ns/word", "peer", "ns/word", "ours / peer", "goal", "result", title="One control word"
    )
    pairs: list[tuple[str, str, float | None]] = [
        ("Motorcade", "bitstruct C, dict", DECODE_GOAL),
        ("Motorcade, from bytes", "bitstruct C, dict", None),
    ]
    for peer in ("bitstruct C, tuple", "shifts by hand, dict", "cantools", "construct"):
        pairs.append(("Motorcade", peer, None))
    add_scalar_rows(table, "decode", scalar_decoders(words, installed), pairs)
    pairs = [
        ("Motorcade", "bitstruct C, dict", ENCODE_GOAL),
        ("Motorcade, **dict", "bitstruct C, ready dict", None),
    ]
    for peer in ("bitstruct C, values in order", "shifts by hand, checked", "cantools", "construct"):
        pairs.append(("Motorcade", peer, None))
    add_scalar_rows(table, "encode", scalar_encoders(words, installed), pairs)
    return table


def main() -> None:
    random = np.random.default_rng(1)
    console = Console(width=130)
    installed = {peer for peer in PEERS if has_peer(console, peer, peer)}
    words = random.integers(0, 1 << 32, SCALAR_WORDS, dtype=np.uint32).tolist()
    console.print(scalar_table(words, installed))


if __name__ == "__main__":
    main()
