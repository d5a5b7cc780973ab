"""Break production code as it once was, or could be, and see how many seeds it takes to notice.

``python -m tests.faults.breaks [NAME …]`` copies the package, changes one place in the copy, runs seeds until a promise
is broken, and prints a table.
"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from shutil import copytree, ignore_patterns

from tests.faults.broken_places import BREAKS, Break

_ROOT = Path(__file__).parents[2]
_MOST_SEEDS = 600


def tried(broken: Break, folder: Path) -> tuple[int | None, str]:
    """The number of seeds until a promise was broken, and which; None where none was."""
    package = folder / "motorcade"
    file = package / broken.file
    text = (_ROOT / "src" / "motorcade" / broken.file).read_text(encoding="utf-8")
    if broken.before not in text:
        raise ValueError(f"{broken.name}: {broken.file} has changed")
    file.write_text(text.replace(broken.before, broken.after, 1), encoding="utf-8")
    command = f"tests.faults {broken.kind} --until-broken --first {broken.first} --seeds {_MOST_SEEDS}"
    try:
        done = subprocess.run(
            [sys.executable, "-m", *command.split()],
            cwd=_ROOT,
            env={**os.environ, "PYTHONPATH": str(folder)},
            capture_output=True,
            text=True,
            check=False,
        )
    finally:
        file.write_text(text, encoding="utf-8")
    if done.returncode == 0:
        return None, ""
    if not (found := re.search(r"--seed (\d+) at [\w ]+: ([\w-]+)", done.stdout)):
        raise ValueError(f"{broken.name}: {done.stderr[-200:]}")
    return int(found[1]) - broken.first + 1, found[2]


def main(names: list[str]) -> int:
    """Try the breaks of these names, or all; print a table."""
    found = 0
    chosen = [each for each in BREAKS if not names or each.name in names or each.kind in names]
    with tempfile.TemporaryDirectory(prefix="motorcade-") as name:
        folder = Path(name)
        copytree(_ROOT / "src" / "motorcade", folder / "motorcade", ignore=ignore_patterns("__pycache__", "page"))
        print("| break | place | promise that noticed it | seeds |\n|---|---|---|---|")
        for each in chosen:
            seeds, promise = tried(each, folder)
            found += seeds is not None
            print(f"| {each.name} | `{each.file}` | {promise} | {seeds or f'none of {_MOST_SEEDS}'} |", flush=True)
    print(f"\n{found} of {len(chosen)} were noticed.")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
