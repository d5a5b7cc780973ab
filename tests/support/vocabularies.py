"""Vocabularies for the tests of exports: Motorcade's, the example's, and formats of other shapes."""

from pathlib import Path

from motorcade.config.own_format import read_format
from motorcade.config.vocabulary import MOTORCADE

WALKER_FILE = Path(__file__).parents[2] / "examples" / "formats" / "walker.toml"

# Single bits that are refused, values that don't begin at 0, pairs told before and after the other one, wide fields.
ODD = """
name = "odd"
field = [
  {name = "last", width = 1, meaning = "always", values = {1 = "yes"}},
  {name = "level", width = 4, meaning = "one bit, neither the first nor none", one_hot = true, range = [2, 8]},
  {name = "count", width = 9, range = [3, 300], unit = "mm", meaning = "long */ \\"so\\" /* | <b> ??/ \\\\ 长度"},
  {name = "present", width = 1, meaning = "whether there is a size", goes_with = "size"},
  {name = "size", width = 17, meaning = "up to a hundred thousand", range = [0, 100000]},
]
"""
WHOLE = """
name = "whole"
[[field]]
name = "value"
width = 32
meaning = "all of it"
"""
BITS = 'name = "bits"\n' + "".join(
    f'[[field]]\nname = "bit{number}"\nwidth = 1\nmeaning = "bit {number}"\nreserved = {str(number % 5 == 0).lower()}\n'
    for number in range(31, -1, -1)
)

VOCABULARIES = [
    MOTORCADE,
    read_format(WALKER_FILE.read_text(encoding="utf-8"), "walker.toml"),
    *(read_format(text, "own.toml") for text in (ODD, WHOLE, BITS)),
]
FORMATS = [word_format for vocabulary in VOCABULARIES for word_format in vocabulary.formats]
