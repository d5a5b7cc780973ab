"""What others say reaches a terminal as text: it obeys nothing of it, and nothing of it is markup."""

import json
import re

import pytest
from rich.text import Text

from motorcade.cli.output import Rows, make_table, plain, print_json, print_lines, print_note, print_result
from motorcade.errors import MotorcadeError

# Escape sequences, C1's, overwriting, direction, an undecodable file name, and Rich's markup.
HOSTILE = "a\x1b[2Jb\x9b31mc\rd\x07e\u202ef\u2066g\udcffh\u2028i\x7fj[red]k[/red][link=file:///x]l"
OBEYED = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")


def test_what_a_terminal_would_obey_is_replaced_and_the_rest_stays(capsys):
    print_lines([HOSTILE])
    print_note(HOSTILE)
    print_result(None, HOSTILE)
    for shown in capsys.readouterr():
        assert not OBEYED.search(shown)
        assert "[red]k[/red][link=file:///x]l" in shown
    assert plain("车\t<b>\n") == "车\t<b>\n"


def test_cells_titles_and_captions_are_no_markup_and_keep_their_styles(capsys):
    rows = [(HOSTILE, Text(HOSTILE, style="dim"), None)]
    print_result(None, Rows(("name", "where", "state"), rows, title=HOSTILE))
    shown = capsys.readouterr().out
    assert not OBEYED.search(shown)
    assert shown.replace("\n", "").count("[red]") >= 1
    table = make_table(("name",), [(Text("ada", style="dim"),)], caption=HOSTILE)
    (cell,) = table.columns[0].cells
    assert (cell.plain, cell.style) == ("ada", "dim")
    assert table.caption.plain == plain(HOSTILE)


def test_json_keeps_what_was_said_in_escapes(capsys):
    print_json({"name": HOSTILE})
    shown = capsys.readouterr().out
    assert not OBEYED.search(shown)
    assert json.loads(shown) == {"name": HOSTILE}


@pytest.mark.parametrize("language", ["en", "zh"])
def test_a_sentence_may_hold_anything(language, capsys):
    print_note(MotorcadeError("no-such-port", port=HOSTILE).sentence(language))
    assert not OBEYED.search(capsys.readouterr().err)
