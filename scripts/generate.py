"""Write the generated files; with --check, write nothing and name those that are out of date.

Three stages, each made of the one before: Python sources from the devices' declarations, the engine, all other files.
"""

import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

from scripts.device_files import device_files
from scripts.device_texts import missing_texts

ROOT = Path(__file__).resolve().parent.parent
# Modules that others import. Only declarations are imported to make them, so they can be made where nothing else works.
SOURCES = device_files()

ENGINE = ROOT / "src" / "motorcade" / "engine"
# What the committed engine was made of. `make soak` makes it again and compares its bytes.
ENGINE_DIGESTS = ROOT / "scripts" / "engine.digests"


def _engine_is_stale() -> bool:
    from scripts.engine_module import FILES, fingerprints

    if not all(path.exists() for path in (ENGINE_DIGESTS, *(ENGINE / name for name in FILES))):
        return True
    made = {name: (ENGINE / name).read_bytes() for name in FILES}
    return ENGINE_DIGESTS.read_text(encoding="utf-8") != fingerprints(made)


def _make_engine() -> None:
    """Make the engine where it is stale: before all else, since other files show runs of it."""
    from scripts.engine_module import engine_files, fingerprints, obstacle

    if not _engine_is_stale():
        return
    if reason := obstacle():
        print(f"!!! the engine was NOT made: {reason} !!!", file=sys.stderr)
        return
    made = engine_files()
    for name, data in made.items():
        (ENGINE / name).parent.mkdir(exist_ok=True)
        (ENGINE / name).write_bytes(data)
        print(f"wrote {(ENGINE / name).relative_to(ROOT)}")
    ENGINE_DIGESTS.write_text(fingerprints(made), encoding="utf-8")


def write(files: Mapping[str, Callable[[], str]], check: bool) -> list[str]:
    """Return which files are out of date; write them anew unless ``check``."""
    stale = []
    for name, make in files.items():
        path, text = ROOT / name, make()
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            stale.append(name)
            if not check:
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(text.encode())
                print(f"wrote {name}")
    return stale


def main() -> int:
    """Return the exit code: 1 where --check finds a file that is out of date, else 0."""
    check = sys.argv[1:] == ["--check"]
    if missing := missing_texts():
        print("\n".join(missing))
        return 1
    stale = write(SOURCES, check)
    if check and _engine_is_stale():
        stale.append(str(ENGINE.relative_to(ROOT)))
    if not check:
        if stale:
            # What was imported so far is older than the sources.
            return subprocess.call([sys.executable, "-m", "scripts.generate"])
        _make_engine()
    if not (check and stale):
        from scripts.generated_files import GENERATED

        stale = write(GENERATED, check)
    if check and stale:
        print(f"Out of date: {', '.join(stale)}. Run `make generate` and commit.")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
