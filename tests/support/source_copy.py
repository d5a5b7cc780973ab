"""A copy of the sources, in which a test adds what CONTRIBUTING.md tells people to add."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from support.waiting import DEADLINE_S

ROOT = Path(__file__).parents[2]


class SourceCopy:
    """The folders that the package is made and generated of, without the pages."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.package = folder / "src" / "motorcade"
        skipped = shutil.ignore_patterns("__pycache__", "page", "libraries", "gallery")
        for name in ("src", "scripts", "firmware"):
            shutil.copytree(ROOT / name, folder / name, ignore=skipped)

    def change(self, path: str, *replacements: tuple[str, str]) -> None:
        """Replace texts of a file, each of which stands there."""
        file = self.folder / path
        text = file.read_text(encoding="utf-8")
        for old, new in replacements:
            assert old in text
            text = text.replace(old, new)
        file.write_text(text, encoding="utf-8")

    def run(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run Python with the copy."""
        environment = {**os.environ, "PYTHONPATH": str(self.package.parent)}
        command = [sys.executable, *arguments]
        return subprocess.run(
            command, cwd=self.folder, env=environment, capture_output=True, text=True, timeout=DEADLINE_S
        )
