"""A made-up chip, export and language, added to a copy of the sources as CONTRIBUTING.md says, work at once."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from support.waiting import DEADLINE_S

ROOT = Path(__file__).parents[1]
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
    folder = tmp_path_factory.mktemp("copy")
    skipped = shutil.ignore_patterns("__pycache__", "page")
    for name in ("src", "scripts"):
        shutil.copytree(ROOT / name, folder / name, ignore=skipped)
    return folder


def run(copy, *arguments):
    environment = {**os.environ, "PYTHONPATH": f"{copy / 'src'}{os.pathsep}{copy}"}
    return subprocess.run(
        [sys.executable, *arguments], cwd=copy, env=environment, capture_output=True, text=True, timeout=DEADLINE_S
    )


def change(file, old, new):
    text = file.read_text(encoding="utf-8")
    assert text.count(old) == 1
    file.write_text(text.replace(old, new), encoding="utf-8")


def test_a_chip_has_its_pins_drawn_and_refused(copy):
    chips = copy / "src" / "motorcade" / "config" / "chips.py"
    change(chips, "\n# Each board whose", f"{CHIP}\n# Each board whose")
    for pin, code in ((4, 0), (3, 2)):
        file = copy / f"pin-{pin}.toml"
        file.write_text(PINS.replace("PIN", str(pin)), encoding="utf-8")
        ran = run(copy, "-m", "motorcade", "car", "wiring", file.name, "-o", "car.svg")
        assert ran.returncode == code, ran.stderr
    assert "Made-up board" in (copy / "car.svg").read_text(encoding="utf-8")


def test_an_export_is_written_and_named(copy):
    (copy / "scripts" / "exports" / "made_up.py").write_text(EXPORT, encoding="utf-8")
    exports = copy / "scripts" / "exports" / "__init__.py"
    change(exports, "from .markdown", "from .made_up import made_up\nfrom .markdown")
    change(exports, "        **brain_c(),", '        "made_up.txt": made_up(),\n        **brain_c(),')
    change(
        copy / "src" / "motorcade" / "cli" / "words.py", "TARGETS = {", 'TARGETS = {\n    "made-up": ("made_up.txt",),'
    )
    written = run(copy, "-c", "from scripts.exports import exported_files; print(exported_files()['made_up.txt'])")
    assert written.stdout == "32 bits\n", written.stderr
    (copy / "src" / "motorcade" / "export" / "made_up.txt").write_text(written.stdout, encoding="utf-8")
    ran = run(copy, "-m", "motorcade", "export", "made-up", "-o", "out")
    assert (ran.returncode, (copy / "out" / "made_up.txt").read_text(encoding="utf-8")) == (0, "32 bits\n"), ran.stderr


def test_a_language_is_offered_and_spoken(copy):
    folder = copy / "src" / "motorcade" / "locales"
    texts = json.loads((folder / "en.json").read_text(encoding="utf-8"))
    texts |= {"language": "Esperanto", "english_name": "Esperanto"}
    texts["errors"]["unknown-target"] = "ne estas {target}"
    (folder / "eo.json").write_text(json.dumps(texts), encoding="utf-8")
    assert "en / eo / zh" in run(copy, "-m", "motorcade", "--help").stdout
    assert "ne estas pascal" in run(copy, "-m", "motorcade", "--language", "eo", "export", "pascal").stderr


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
