"""The shortest program that a search has found for each mission; scripts/shortest_programs.py makes shortest.json."""

import json
from functools import cache
from importlib import resources
from typing import Any


@cache
def shortest_programs() -> dict[str, dict[str, Any]]:
    """Of each mission by id the shortest ``program`` found for all stars, its ``blocks``, and the search's ``runs``."""
    text = (resources.files("motorcade.missions") / "shortest.json").read_text(encoding="utf-8")
    found: dict[str, dict[str, Any]] = json.loads(text)
    return found
