"""Capsules: a sweep as one file, with all that it takes to run it again and to see that every bit is the same.

A capsule is a ZIP file. Its comment is the SHA-256 of all bytes before it, so no byte can change unnoticed. Programs
are stored as images and mats with the place of each car, so that neither the compiler's nor the mats' rules matter.

Anybody can make a capsule with a seal that fits. So nothing in it is compressed, its table has as many rows as the
sweep has runs, and whatever has another shape than it ought to makes it no capsule.
"""

import hashlib
import io
import json
import platform
import struct
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from motorcade import __version__
from motorcade.config.files import decoded, parse, read_bytes, replace_file
from motorcade.config.profile import profile_from_dict
from motorcade.errors import InputError, MotorcadeError, Phrase
from motorcade.lab.plan import Plan, code_hash
from motorcade.lab.run import ProgressBar, Workers, read_rows
from motorcade.lab.spec import parse_sweep
from motorcade.lab.task import DIGESTS, checkpoint_ticks
from motorcade.mats.document import cars_of, document_of, mat_of
from motorcade.words.image import parse_image_bytes

FORMAT = "motorcade-capsule/1"
_ABOUT = "capsule.json"
_SPEC = "sweep.toml"
_TABLE = "table.parquet"
_CITATION = "CITATION.cff"
_SEAL_BYTES = 64
_MOST_BYTES = 1 << 30
# What Python raises where a capsule has another shape than it ought to; msgspec's errors are ValueErrors.
_MADE_UP = (
    *(zipfile.BadZipFile, LookupError, ValueError, TypeError, AttributeError, ArithmeticError),
    *(NotImplementedError, RuntimeError, EOFError, zlib.error, struct.error, msgspec.MsgspecError),
)
# What a capsule's citation says of Motorcade: fields of the repository's CITATION.cff.
_MOTORCADE = {
    "type": "software",
    "title": "Motorcade: program and drive small cars with 32-bit words",
    "authors": [{"name": "The Motorcade maintainers"}],
    "license": "MIT",
}


class _About(msgspec.Struct):
    """What a capsule says of itself."""

    format: str
    versions: dict[str, str]
    checkpoints: int


class RunDifference(NamedTuple):
    """The first run of a capsule that came out otherwise, and where.

    Attributes:
        run: its number, of the program, mat and parameters ``point`` and with ``seed``.
        tick: the first checkpoint at which a car differs; ``same``: the one before, 0 for the beginning.
        car: the first car that differs there.
    """

    run: int
    point: Phrase
    seed: int
    tick: int
    same: int
    car: int


def write_capsule(path: Path, spec: bytes, plan: Plan, table: Path) -> None:
    """Write the capsule of a finished sweep with digests.

    Args:
        spec: the bytes of its specification.

    Raises:
        OSError: a file can't be read or written.
    """
    versions = {"motorcade": __version__, "code": code_hash(), "python": platform.python_version()}
    versions |= {"numpy": version("numpy"), "pyarrow": version("pyarrow"), "platform": platform.platform()}
    about = {"format": FORMAT, "versions": versions, "runs": plan.runs, "checkpoints": plan.checkpoints}
    members = {_ABOUT: _json(about | {"contents": plan.contents}), _SPEC: spec}
    members[_CITATION] = _citation(plan.sweep.citation, __version__)
    for number, (image, profile) in enumerate(plan.programs):
        document = asdict(profile)
        members[f"programs/{number}.image"] = image
        members[f"programs/{number}.profile.json"] = _json({"name": document.pop("name"), "profile": document})
    for number, mat in enumerate(plan.mats):
        if mat is not None:
            members[f"mats/{number}.json"] = _json(document_of(mat) | {"car": cars_of(mat.starts)})
    members[_TABLE] = table.read_bytes()
    written = io.BytesIO()
    with zipfile.ZipFile(written, "w") as archive:
        for name, data in members.items():
            archive.writestr(zipfile.ZipInfo(name), data)
        archive.comment = bytes(_SEAL_BYTES)
    replace_file(path, _sealed(written.getvalue()))


def verify(path: Path, sample: int | None, workers: Workers, bar: ProgressBar) -> tuple[int, RunDifference | None]:
    """Run a capsule again, all runs or ``sample`` of them, which are spread evenly over all.

    Returns:
        How many runs were made again, and the first that differs; None: all are equal to the last bit.

    Raises:
        MotorcadeError: the file is no capsule or has changed, it can't be read or run any more.
        OSError: the file can't be read.
    """
    with _opened(path) as archive:
        about = msgspec.json.decode(archive.read(_ABOUT), type=_About)
        if about.format != FORMAT:
            raise InputError("capsule-of-another-format", file=path, format=about.format[:40], ours=FORMAT)
        try:
            plan = _plan(archive, path.name, about)
        except MotorcadeError as problem:
            made = about.versions["motorcade"][:40]
            raise InputError("capsule-formats-changed", file=path, version=made, reason=problem) from None
        expected = _digests(archive.read(_TABLE), plan.runs)
    if sample is not None and sample < plan.runs:
        plan = plan.of_runs([plan.runs * number // sample for number in range(sample)])
    first: dict[str, Any] | None = None
    done = 0
    with bar("runs", plan.runs) as advance, closing(workers(plan, range(plan.tasks))) as results:
        for _, rows in results:
            for row in read_rows(io.BytesIO(rows)).to_pylist():
                differs = row[DIGESTS] != expected[row["run"]].as_py()
                if differs and (first is None or row["run"] < first["run"]):
                    first = row
                done += 1
            advance(done)
    difference = None
    if first is not None:
        difference = _difference(plan, first, expected[first["run"]].as_py())
    return done, difference


def _difference(plan: Plan, row: dict[str, Any], expected: bytes) -> RunDifference:
    # Another number of bytes is a difference at the beginning.
    stored_bytes = (expected or b"").ljust(len(row[DIGESTS]), b"\0")[: len(row[DIGESTS])]
    found, stored = (np.frombuffer(digests, "<u8") for digests in (row[DIGESTS], stored_bytes))
    cell = row["run"] // len(plan.sweep.seeds)
    ticks = checkpoint_ticks(plan.sweep.duration_ms // plan.tick_ms(cell), plan.checkpoints)
    differs = (found != stored).reshape(len(ticks), -1)
    at = int(np.argmax(differs.any(axis=1)))
    same = 0
    if at:
        same = ticks[at - 1]
    return RunDifference(row["run"], plan.place(cell), row["seed"], ticks[at], same, int(np.argmax(differs[at])))


@contextmanager
def _opened(path: Path) -> Iterator[zipfile.ZipFile]:
    """Open a capsule and check its seal."""
    try:
        data = read_bytes(path, _MOST_BYTES)
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            if len(archive.comment) != _SEAL_BYTES or _ABOUT not in archive.namelist():
                raise InputError("not-a-capsule", file=path)
            if _sealed(data) != data:
                part = archive.testzip()
                raise InputError("capsule-changed", file=path, part=part or Phrase("capsule-directory"))
            members = archive.infolist()
            is_bare = all(member.compress_type == zipfile.ZIP_STORED for member in members)
            if not is_bare or sum(member.file_size for member in members) > len(data):
                raise InputError("not-a-capsule", file=path)
            yield archive
    except _MADE_UP:
        raise InputError("not-a-capsule", file=path) from None


def _sealed(data: bytes) -> bytes:
    """The bytes of a capsule with the right seal."""
    return data[:-_SEAL_BYTES] + hashlib.sha256(data[:-_SEAL_BYTES]).hexdigest().encode()


def _digests(table: bytes, runs: int) -> Any:
    """Return the digests of all runs. Raises ValueError, MotorcadeError; a table may claim to be larger than memory."""
    try:
        about = pq.read_metadata(io.BytesIO(table))
    except (pa.ArrowException, OSError):
        raise ValueError("no table") from None
    groups = [about.row_group(at) for at in range(about.num_row_groups)]
    columns = [group.column(at) for group in groups for at in range(group.num_columns)]
    size = sum(column.total_uncompressed_size for column in columns if column.path_in_schema == DIGESTS)
    if about.num_rows != runs or size > _MOST_BYTES:
        raise ValueError("another table")
    # One value may stand for millions of rows.
    digests = read_rows(io.BytesIO(table), [DIGESTS], [DIGESTS])[DIGESTS]
    kind = digests.type
    if pa.types.is_dictionary(digests.type):
        kind = digests.type.value_type
    if not pa.types.is_binary(kind):
        raise ValueError("no digests")
    return digests


def _plan(archive: zipfile.ZipFile, name: str, about: "_About") -> Plan:
    """Make the plan of a capsule. Raises MotorcadeError: a format has changed."""
    programs = []
    there = set(archive.namelist())
    # A sweep that names no mats may have had that of its only program.
    sweep = parse_sweep(decoded(archive.read(_SPEC)), f"{name}/{_SPEC}", lambda program: "mats/0.json" in there)
    for number in range(len(sweep.programs)):
        place = f"programs/{number}.profile.json"
        document = parse(archive.read(place), "JSON", f"{name}/{place}")
        profile = profile_from_dict(document["profile"], document["name"])
        image = archive.read(f"programs/{number}.image")
        parse_image_bytes(image)
        programs.append((image, profile))
    mats = []
    for number in range(len(sweep.mats)):
        place = f"mats/{number}.json"
        mat = None
        if place in there:
            mat = mat_of(parse(archive.read(place), "JSON", f"{name}/{place}"), f"{name}/{place}")
        mats.append(mat)
    plan = Plan(sweep, programs, mats, about.versions["motorcade"], with_digests=True)
    if not 1 <= about.checkpoints <= plan.checkpoints:
        raise ValueError("more checkpoints than there can be")
    plan.checkpoints = about.checkpoints
    return plan


def _citation(given: Mapping[str, Any], made_by: str) -> bytes:
    """A citation file (CFF 1.2.0) for the capsule as a data set; each value is JSON, which is YAML, too."""
    fields = {
        "cff-version": "1.2.0",
        "message": "If you use this data set, please cite it as below.",
        "type": "dataset",
        "title": "A sweep of simulated cars",
        **given,
        "authors": [{"name": name} for name in given.get("authors", ["anonymous"])],
        "references": [{**_MOTORCADE, "version": made_by}],
    }
    return "".join(f"{name}: {json.dumps(value, ensure_ascii=False)}\n" for name, value in fields.items()).encode()


def _json(document: Any) -> bytes:
    return json.dumps(document, indent=1, ensure_ascii=False).encode()
