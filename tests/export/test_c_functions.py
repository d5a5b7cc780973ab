"""Which Python is translated to C, how, and which is refused where."""

import subprocess

import pytest
from scripts.exports.c_functions import Program
from scripts.exports.c_source import Source

from motorcade.errors import MotorcadeError

HELPERS = """
LIMIT = 1 << 20
HUGE = 1 << 32

def bump(s: list[int]) -> int:
    s[0] = s[0] + 1
    return s[0]

"""


def translated(text):
    """The lines of the function ``f`` in C."""
    values = {}
    exec(HELPERS + text, {"int32": int, "uint8": int, "uint16": int}, values)
    source = Source("snippet", "snippet.py", HELPERS + text, values)
    program = Program((source,))
    program.function(source, "f", source.functions["f"], source)
    return program.bodies["snippet", "f"]


@pytest.mark.parametrize(
    ("text", "line", "reason"),
    [
        ("def f(x: int) -> int:\n    return x / 2", 2, "outside"),
        ("def f(x: int) -> int:\n    return ~x", 2, "outside"),
        ("def f(x: int) -> int:\n    x += 1\n    return x", 2, "outside"),
        ("def f(x: int) -> int:\n    a = b = x\n    return a", 2, "outside"),
        ("def f(x: int) -> int:\n    while x > 3:\n        break\n    return x", 3, "outside"),
        ("def f(x: int) -> int:\n    return x << 32", 2, "outside"),
        ("def f(x: int = 3) -> int:\n    return x", 1, "outside"),
        ("def f(x: int):\n    return x", 1, "no annotation"),
        ("def f(x: 'dict[int, int]') -> int:\n    return 1", 1, "no annotation"),
        ("def f(x: int) -> int:\n    return x & 0x100000000", 2, "no integer of 32 bits"),
        ("def f(x: int) -> int:\n    return y", 2, "nothing that is translated"),
        ("def f(x: int) -> int:\n    return f(x - 1)", 2, "call itself"),
        ("def f(x: int) -> int:\n    if x:\n        return 3", 1, "on every way"),
        ("def f(volatile: int) -> int:\n    return volatile", 1, "reserved name"),
        ("def f(x: int, y: int32) -> int:\n    return x + y", 2, "may be negative"),
        ("def f(y: int32) -> int32:\n    return y // 2", 2, "negative"),
        ("def f(s: list[int]) -> int:\n    return bump(s) * bump(s)", 2, "in any order"),
        ("def f(x: uint8) -> int:\n    y = x\n    y = x + 300\n    return y", 3, "more bits"),
    ],
)
def test_what_has_no_counterpart_in_c_is_refused_with_file_and_line(text, line, reason):
    with pytest.raises(MotorcadeError) as refused:
        translated(text)
    place = f"snippet.py, line {line + HELPERS.count(chr(10))}: "
    assert str(refused.value).startswith(place)
    assert reason in str(refused.value)
    assert refused.value.sentence("zh") != str(refused.value)


def test_a_loop_computes_its_end_once_as_in_python(gcc, tmp_path):
    text = (
        "def f(x: int) -> int:\n    n = 0\n    for i in range(x):\n        x = x + 1\n        n = n + i\n    return n"
    )
    code = "\n".join(
        ["#include <stdint.h>", *translated(text), "int main(void) { return (int)motorcade_snippet_f(5); }"]
    )
    (tmp_path / "a.c").write_text(code)
    subprocess.run([gcc, "-std=c99", tmp_path / "a.c", "-o", tmp_path / "a"], check=True)
    assert subprocess.run([tmp_path / "a"], check=False).returncode == 0 + 1 + 2 + 3 + 4
