"""Links that open the studio with a program, for the documentation; MkDocs calls `on_page_markdown` for each page.

A link follows each block of Python that is a whole program; `<!-- examples -->` becomes the table of the examples.
"""

import re
import sys
from pathlib import Path
from typing import Any

sys.path.append(str(Path(__file__).resolve().parents[1]))
from scripts.studio_process import ROOT, project_link

from motorcade.program.diagnostics import ProgramError
from motorcade.program.python_reader import read_python
from motorcade.service.documents import examples, project_of, project_text

EXAMPLES = "<!-- examples -->"
_LINK = {"en": "Try it", "zh": "试一试"}
_BLOCK = re.compile(r'^```python(?: title="(?P<name>\w+)\.py")?\n(?P<text>.*?)^```\n', re.MULTILINE | re.DOTALL)
_GALLERY = ROOT / "src" / "motorcade" / "service" / "gallery"


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Add the links to a page's text."""
    studio, language = config["extra"]["studio"], "zh" if page.file.src_uri.endswith(".zh.md") else "en"

    def with_link(block: re.Match[str]) -> str:
        try:
            project = project_of(read_python(block["text"]).program)
        except ProgramError:
            return block[0]
        link = _link(studio, block["name"] or "", project_text(project), language)
        return f"{block[0]}\n{link}\n"

    return _BLOCK.sub(with_link, markdown).replace(EXAMPLES, _table(studio, language))


def _table(studio: str, language: str) -> str:
    """Return the table of the examples that the studio has."""
    rows = []
    for example in examples():
        text = (_GALLERY / f"{example.id}.motorcade.json").read_text(encoding="utf-8")
        title = example.title[language]
        rows.append(f"| {title} | {example.about[language]} | {_link(studio, title, text, language)} |")
    return "\n".join(["| | | |", "|---|---|---|", *rows])


def _link(studio: str, name: str, text: str, language: str) -> str:
    """Return a link to the studio that opens a project; the page stays open."""
    address = project_link(studio, text, name)
    return f'[{_LINK[language]}]({address}){{ target="_blank" rel="noopener" }}'
