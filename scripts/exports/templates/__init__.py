"""The parts of exported files that are the same for all formats."""

import re
from importlib import resources


def filled_template(name: str, **texts: str) -> str:
    """Return a file of this folder, each ``@NAME@`` in it replaced by the text of that name."""
    template = (resources.files(__package__) / name).read_text(encoding="utf-8")
    return re.sub("@([A-Z_]+)@", lambda place: texts[place[1]], template)
