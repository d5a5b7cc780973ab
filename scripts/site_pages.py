"""Pages that only the documentation's site has, made from the code whenever it is built; MkDocs calls `on_config`.

There the wirings of boards are tabs, of which one is shown, and the tables of pins are folded (`on_page_markdown`).
"""

import re
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from textwrap import indent
from typing import Any

sys.path.append(str(Path(__file__).resolve().parents[1]))
from scripts.blocks_page import blocks_page
from scripts.commands_page import commands_page
from scripts.exports import markdown
from scripts.notes_page import notes_page
from scripts.studio_process import ROOT
from scripts.wiring_pages import wiring_table

from motorcade.locales import text

_ENDINGS = {"en": ".md", "zh": ".zh.md"}
# Where the READMEs turn to developers.
_DEVELOP = re.compile("^## (Develop|开发)$", re.M)


def home_page(language: str) -> str:
    """Return what the README says to users, without the links that leave docs/."""
    readme = (ROOT / f"README{_ENDINGS[language]}").read_text(encoding="utf-8")
    users = _DEVELOP.split(readme)[0].replace("](docs/", "](")
    return re.sub(r"\[(中文|English)\]\([^)]+\)\n", "", users).replace("[`examples/`](examples)", "`examples/`")


# What makes each page in a language, by its name.
SITE_PAGES: dict[str, Callable[[str], str]] = {
    "blocks": blocks_page,
    "commands": commands_page,
    "index": home_page,
    "notes": notes_page,
    "words": markdown,
}
_WIRING = re.compile(
    r"^### (?P<title>[^\n]+)\n(?P<body>(?:(?!^#).)*?<!-- wiring: (?P<car>[\w-]+) -->.*?)(?=^#|\Z)", re.M | re.DOTALL
)
# The table of a car's pins takes its place.
_PINS = re.compile(r"<!-- pins: ([\w-]+) -->")
# What the site is built from; it goes when the build ends.
_WHOLE = TemporaryDirectory()


def write_pages(folder: Path) -> None:
    """Write all of them in both languages."""
    for name, make in SITE_PAGES.items():
        for language, ending in _ENDINGS.items():
            (folder / f"{name}{ending}").write_text(make(language), encoding="utf-8")


def on_config(config: Any) -> None:
    """Build the site from the pages of docs/ and these. The plugin of languages configures each language anew."""
    if config.docs_dir != _WHOLE.name:
        shutil.copytree(config.docs_dir, _WHOLE.name, dirs_exist_ok=True)
        write_pages(Path(_WHOLE.name))
        config.docs_dir = _WHOLE.name


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Show one wiring at a time, with its table of pins folded."""
    language = "zh" if page.file.src_uri.endswith(".zh.md") else "en"

    def tab(section: re.Match[str]) -> str:
        table = indent(wiring_table(section["car"], language), "    ")
        folded = f'??? note "{text("command_line", "column-pin", {}, language)}"\n\n{table}'
        body = indent(f"{section['body'].strip()}\n\n{folded}", "    ")
        return f'=== "{section["title"]}"\n\n{body}\n\n'

    whole = _PINS.sub(lambda mark: wiring_table(mark[1], language), markdown)
    return _WIRING.sub(tab, whole)
