"""What to install where a library is missing: the smallest extra of Motorcade that brings it, as a command."""

import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from motorcade.errors import MotorcadeError, Phrase

# What a part's own extra doesn't bring, since only some of its uses need it.
_EXTRA_OF = {
    "dask": "cluster",
    "distributed": "cluster",
    "matplotlib": "runs",
    "mcap": "runs",
    "pyarrow": "sim",
}


@contextmanager
def needs_extra(part: str, extra: str) -> Iterator[None]:
    """Raise MotorcadeError, which says how to install an extra, where the block can't import a library of it.

    Args:
        part: what needs it: the phrase "part-…".
        extra: the smallest one that suffices for the part's usual work.
    """
    try:
        yield
    except ModuleNotFoundError as missing:
        if not missing.name or missing.name.startswith("motorcade"):
            raise
        extra = _EXTRA_OF.get(missing.name.partition(".")[0], extra)
        details = {"part": Phrase(f"part-{part}"), "library": missing.name, "command": install_command(extra)}
        raise MotorcadeError("extra-not-installed", **details) from None


def install_command(extra: str) -> str | Phrase:
    """Return how to add ``extra`` to this installation: by the command for the clone, wheel or index it came from."""
    import json
    from importlib.metadata import PackageNotFoundError, distribution
    from urllib.parse import urlsplit
    from urllib.request import url2pathname

    try:
        direct = distribution("motorcade").read_text("direct_url.json")
    except PackageNotFoundError:
        return Phrase("install-anywhere", extra=extra)
    if direct is None:
        return f'{_pip()} install "motorcade[{extra}]"'
    record = json.loads(direct)
    source = Path(url2pathname(urlsplit(record["url"]).path))
    if not source.exists():
        return Phrase("install-anywhere", extra=extra)
    editable = "-e " if record.get("dir_info", {}).get("editable") else ""
    return f'{_pip()} install {editable}"{source}[{extra}]"'


def _pip() -> str:
    """Return what calls this installation's own pip, which need not be the shell's."""
    found = shutil.which("pip")
    if found and Path(found).parent == Path(sys.executable).parent:
        return "pip"
    return f'"{sys.executable}" -m pip' if " " in sys.executable else f"{sys.executable} -m pip"
