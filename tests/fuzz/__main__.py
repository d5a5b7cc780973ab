"""Fuzz with coverage: ``python -m tests.fuzz [NAME ...] --seconds N``. Atheris does it, on Linux and x86-64 alone.

Each program of `tests.fuzz.harnesses` runs in a process of its own, from its corpus. An input that fails is added to
the corpus, with which `make test` runs it again. ``--keep`` renews the corpus: by a few of all inputs that together
reach most lines.
"""

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path
from random import Random

from tests.fuzz.corpus import add, corpus, keep

# As pytest has it: the harnesses use what other tests share.
sys.path.insert(0, str(Path(__file__).parents[1]))
# What an input may take, and how long it may be.
_MOST_S, _MOST_MB, _MOST_BYTES = 20, 3000, 1500


def fuzz_here(name: str, folder: Path, seconds: int) -> None:
    """Fuzz in this process, which Atheris ends."""
    import atheris

    with atheris.instrument_imports(include=["motorcade"]):
        from tests.fuzz.harnesses import HARNESSES
    limits = f"-timeout={_MOST_S} -rss_limit_mb={_MOST_MB} -max_len={_MOST_BYTES} -max_total_time={seconds}"
    others = f"-len_control=0 -print_final_stats=1 -artifact_prefix={folder}/failed- {folder}/in"
    arguments = [*limits.split(), *others.split()]
    atheris.Setup(["fuzz", *arguments], HARNESSES[name].hypothesis.fuzz_one_input)
    atheris.Fuzz()


def fuzz(name: str, seconds: int, keeps: bool) -> bool:
    """Fuzz one harness; return whether nothing failed."""
    with tempfile.TemporaryDirectory(prefix="motorcade-") as place:
        folder, random = Path(place), Random(0)
        (folder / "in").mkdir()
        for number, data in enumerate(corpus(name) or [random.randbytes(size) for size in range(40, 1240, 60)]):
            (folder / "in" / f"seed{number}").write_bytes(data)
        told = subprocess.run(
            [sys.executable, "-m", "tests.fuzz", name, "--seconds", str(seconds), "--inside", place],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            check=False,
        ).stdout
        found = [each.read_bytes() for each in (folder / "in").iterdir()]
        failed = [each.read_bytes() for each in folder.glob("failed-*")]
    tries = next((line.split()[-1] for line in told.splitlines() if "executed_units" in line), "no")
    print(f"{name}: {tries} inputs in {seconds} s, {len(found)} of them reached something new, {len(failed)} failed")
    if failed or tries == "no":
        print(told[-6000:])
    if keeps:
        keep(name, found)
    add(name, failed)
    return not failed and tries != "no"


def main(arguments: list[str]) -> int:
    """Fuzz the harnesses of these names, or all; return 1 where an input failed."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz")
    parser.add_argument("names", nargs="*")
    parser.add_argument("--seconds", type=int, default=60, help="for each")
    parser.add_argument("--keep", action="store_true", help="renew the corpus")
    parser.add_argument("--inside", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args(arguments)
    if given.inside:
        fuzz_here(given.names[0], given.inside, given.seconds)
    if find_spec("atheris") is None:
        print("Nothing was fuzzed: there is no Atheris for this computer.")
        return 0
    names: Iterable[str] = given.names
    if not names:
        from tests.fuzz.harnesses import HARNESSES

        names = HARNESSES
    results = [fuzz(name, given.seconds, given.keep) for name in names]
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
