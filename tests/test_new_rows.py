"""A made-up chip, export and language, added to a copy of the sources as CONTRIBUTING.md says, work at once."""

import json
import re

import pytest

from support.source_copy import ROOT, SourceCopy

CHIP = """
CHIPS += (Chip("made-up", "Made-up board", dict.fromkeys(range(20), 0), taken={3: _USB}, runs_linux=True),)
"""
PINS = """format = "motorcade-pins/1"
name = "Car"
chip = "made-up"
[leds]
led_0 = PIN
"""
EXPORT = '''"""How many bits a word has, for a made-up tool."""


def made_up() -> str:
    """Return its text."""
    return "32 bits"
'''


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    return SourceCopy(tmp_path_factory.mktemp("copy"))


def test_a_chip_has_its_pins_drawn_and_refused(copy):
    copy.change("src/motorcade/config/chips.py", ("\n# Each board whose", f"{CHIP}\n# Each board whose"))
    for pin, code in ((4, 0), (3, 2)):
        file = copy.folder / f"pin-{pin}.toml"
        file.write_text(PINS.replace("PIN", str(pin)), encoding="utf-8")
        ran = copy.run("-m", "motorcade", "car", "wiring", file.name, "-o", "car.svg")
        assert ran.returncode == code, ran.stderr
    assert "Made-up board" in (copy.folder / "car.svg").read_text(encoding="utf-8")


def test_an_export_is_written_and_named(copy):
    (copy.folder / "scripts" / "exports" / "made_up.py").write_text(EXPORT, encoding="utf-8")
    copy.change(
        "scripts/exports/__init__.py",
        ("from .markdown", "from .made_up import made_up\nfrom .markdown"),
        ("        **brain_c(),", '        "made_up.txt": made_up(),\n        **brain_c(),'),
    )
    copy.change("src/motorcade/cli/words.py", ("TARGETS = {", 'TARGETS = {\n    "made-up": ("made_up.txt",),'))
    written = copy.run("-c", "from scripts.exports import exported_files; print(exported_files()['made_up.txt'])")
    assert written.stdout == "32 bits\n", written.stderr
    (copy.package / "export" / "made_up.txt").write_text(written.stdout, encoding="utf-8")
    ran = copy.run("-m", "motorcade", "export", "made-up", "-o", "out")
    assert (ran.returncode, (copy.folder / "out" / "made_up.txt").read_text(encoding="utf-8")) == (0, "32 bits\n"), (
        ran.stderr
    )


def test_a_language_is_offered_and_spoken(copy):
    folder = copy.package / "locales"
    texts = json.loads((folder / "en.json").read_text(encoding="utf-8"))
    texts |= {"language": "Esperanto", "english_name": "Esperanto"}
    texts["errors"]["unknown-target"] = "ne estas {target}"
    (folder / "eo.json").write_text(json.dumps(texts), encoding="utf-8")
    assert "en / eo / zh" in copy.run("-m", "motorcade", "--help").stdout
    assert "ne estas pascal" in copy.run("-m", "motorcade", "--language", "eo", "export", "pascal").stderr


LISTED = {
    ("chip", "芯片"): ["config/chips.py"],
    ("export", "导出"): ["scripts/exports/<target>.py", "scripts/exports/__init__.py", "cli/words.py"],
    ("language", "语言"): ["locales/<language>.json"],
}


@pytest.mark.parametrize("what", LISTED, ids=lambda names: names[0])
def test_what_is_changed_here_is_in_the_lists(what):
    for page, head in zip(("CONTRIBUTING.md", "CONTRIBUTING.zh.md"), what, strict=True):
        text = (ROOT / page).read_text(encoding="utf-8")
        (rows,) = re.findall(rf"^## (?:How to add an? |添加一种){head}\n(.*?)(?=^## )", text, re.M | re.DOTALL)
        first_column = "".join(row.split("|")[1] for row in rows.splitlines() if row.startswith("|"))
        assert [file for file in LISTED[what] if f"`{file}`" not in first_column] == []
