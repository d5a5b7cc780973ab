"""Capsules: a sweep in one file, run again to the last bit; what differs, what has changed, and what is no capsule."""

import hashlib
import io
import json
import zipfile
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from motorcade.errors import MotorcadeError
from motorcade.lab import run as running
from motorcade.lab.capsule import verify
from motorcade.lab.task import run_task
from support.command_line import PARADE, Terminal, data, refusal, run

ROOT = Path(__file__).parents[2]
SPEC = """
format = "motorcade-sweep/1"
programs = ["parade.motorcade.json"]
mats = ["hall.toml"]
seconds = 2
seeds = 3

[grid]
physics.wheel_noise = [0, 0.1]

[citation]
title = "Noise in a hall"
authors = ["Lin Wei"]
license = "CC-BY-4.0"
"""
MAT = """
format = "motorcade-mat/1"
name = "hall"
size_m = [4, 4]
tick_ms = 20
car = [{at_m = [2, 2], role = "leader"}, {at_m = [1, 1]}, {at_m = [1, 3]}, {at_m = [3, 1]}]
"""
RUNS = 6


def in_this_process(plan, tasks):
    for index in tasks:
        yield index, run_task(plan.task(index))


@pytest.fixture(autouse=True, scope="module")
def no_processes():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(running, "on_this_computer", lambda *given: in_this_process)
        yield


@pytest.fixture(scope="module")
def capsule(tmp_path_factory):
    """A capsule whose specification, program and mat are there no more."""
    folder = tmp_path_factory.mktemp("sweep")
    (folder / PARADE.name).write_bytes(PARADE.read_bytes())
    (folder / "spec.toml").write_text(SPEC, encoding="utf-8")
    (folder / "hall.toml").write_text(MAT, encoding="utf-8")
    written = folder / "run.zip"
    made = data("sweep", folder / "spec.toml", "-o", folder / "a.parquet", "--capsule", written)
    assert made["capsule"] == str(written)
    for file in [each for each in folder.iterdir() if each != written]:
        file.unlink()
    return written


def changed(capsule, folder, changes, how=zipfile.ZIP_STORED):
    """A copy with other members, stored in this way, and a seal that fits."""
    copy = folder / "changed.zip"
    with zipfile.ZipFile(capsule) as archive, zipfile.ZipFile(copy, "w") as other:
        for name in archive.namelist():
            data, kind = archive.read(name), how if name in changes else zipfile.ZIP_STORED
            other.writestr(name, changes.get(name, lambda data: data)(data), kind)
        other.comment = bytes(64)
    sealed = copy.read_bytes()[:-64]
    copy.write_bytes(sealed + hashlib.sha256(sealed).hexdigest().encode())
    return copy


def test_it_is_equal_to_the_last_bit(capsule):
    assert data("verify", capsule) == {"runs": RUNS, "equal": True}
    ran = run("verify", capsule, "--sample", 2, "--json")
    assert (ran.code, json.loads(ran.out)["runs"]) == (0, 2)


def turned(mat):
    document = json.loads(mat)
    document["car"][2]["heading_deg"] += 1e-5
    return json.dumps(document).encode()


def later(table):
    """The table with another bit in the digest of car 3 of 4 at the sixth checkpoint of the first run."""
    rows = pq.read_table(io.BytesIO(table))
    first, *others = rows["digests"].to_pylist()
    at = (5 * 4 + 3) * 8
    digests = pa.array([first[:at] + bytes([first[at] ^ 1]) + first[at + 1 :], *others], pa.binary())
    written = io.BytesIO()
    pq.write_table(rows.set_column(rows.schema.get_field_index("digests"), "digests", digests), written)
    return written.getvalue()


@pytest.mark.parametrize(
    ("part", "change", "tick", "same", "car"), [("mats/0.json", turned, 1, 0, 2), ("table.parquet", later, 6, 5, 3)]
)
def test_the_first_run_tick_and_car_that_differ_are_named(capsule, tmp_path, part, change, tick, same, car):
    ran = run("verify", changed(capsule, tmp_path, {part: change}), "--json")
    found = json.loads(ran.out)
    assert (ran.code, found["equal"], found["run"], found["seed"], found["car"]) == (1, False, 0, 0, car)
    # The run of 100 ticks has a checkpoint after each of them.
    assert (found["tick"], found["same"]) == (tick, same)


def nobody(plan, tasks):
    raise AssertionError("nothing runs")


def code_of(capsule):
    with pytest.raises(MotorcadeError) as caught:
        verify(capsule, None, nobody, None)
    return caught.value.code


def test_no_byte_changes_unnoticed(capsule, tmp_path):
    whole = capsule.read_bytes()
    for number in range(60):
        place = len(whole) * number // 59 - (number == 59)
        spoilt = tmp_path / "spoilt.zip"
        spoilt.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        assert code_of(spoilt) in ("capsule-changed", "not-a-capsule"), place


def test_the_part_that_has_changed_is_named(capsule, tmp_path):
    whole = capsule.read_bytes()
    (tmp_path / "a.zip").write_bytes(whole.replace(b"Noise in a hall", b"Voice in a hall", 1))
    assert "sweep.toml has other bytes" in refusal(2, "verify", tmp_path / "a.zip")
    (tmp_path / "b.zip").write_bytes(whole[:-1000])
    assert "is no capsule of a sweep" in refusal(2, "verify", tmp_path / "b.zip")
    (tmp_path / "c.zip").write_text("hello")
    assert "is no capsule of a sweep" in refusal(2, "verify", tmp_path / "c.zip")


def test_a_format_that_has_changed_is_named(capsule, tmp_path):
    later = changed(capsule, tmp_path, {"capsule.json": lambda data: data.replace(b"capsule/1", b"capsule/2")})
    assert "motorcade-capsule/2" in refusal(2, "verify", later)
    older = changed(capsule, tmp_path, {"sweep.toml": lambda data: data.replace(b"sweep/1", b"sweep/0")})
    says = refusal(2, "verify", older)
    assert "Motorcade 0.1.0" in says
    assert "motorcade-sweep/1" in says


def test_its_citation_has_what_a_doi_needs(capsule):
    with zipfile.ZipFile(capsule) as archive:
        lines = archive.read("CITATION.cff").decode().splitlines()
    citation = {name: json.loads(value) for name, _, value in (line.partition(": ") for line in lines)}
    given = {name: citation[name] for name in ("cff-version", "type", "title", "authors", "license")}
    assert given == {
        "cff-version": "1.2.0",
        "type": "dataset",
        "title": "Noise in a hall",
        "authors": [{"name": "Lin Wei"}],
        "license": "CC-BY-4.0",
    }
    (motorcade,) = citation["references"]
    ours = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    for value in (motorcade["title"], motorcade["license"], motorcade["version"], motorcade["authors"][0]["name"]):
        assert value in ours


def test_who_forgets_the_authors_is_told_and_a_bad_name_is_refused_first(tmp_path):
    (tmp_path / PARADE.name).write_bytes(PARADE.read_bytes())
    (tmp_path / "a.toml").write_text(SPEC.partition("mats")[0] + "seconds = 0.1", encoding="utf-8")
    paths = "-o", tmp_path / "a.parquet", "--capsule", tmp_path / "a.zip"
    out = Terminal()
    run("sweep", tmp_path / "a.toml", *paths, stdout=out)
    assert "names no authors" in out.getvalue()
    there = tmp_path / "b.parquet"
    for name, says in ((tmp_path / "a.txt", "must end in .zip"), (tmp_path / "no" / "a.zip", "there is no folder")):
        assert says in refusal(2, "sweep", tmp_path / "a.toml", "-o", there, "--capsule", name)
    assert not there.exists()


@pytest.mark.parametrize("part", ["capsule.json", "sweep.toml", "table.parquet"])
def test_a_capsule_with_a_compressed_member_is_none(capsule, tmp_path, part):
    """64 MB of zeros are 64 KB in it."""
    assert (
        code_of(changed(capsule, tmp_path, {part: lambda data: bytes(1 << 26)}, zipfile.ZIP_DEFLATED))
        == "not-a-capsule"
    )


def table_of(digests):
    written = io.BytesIO()
    pq.write_table(pa.table({"digests": digests}), written)
    return written.getvalue()


STRANGE = (
    *[("capsule.json", content) for content in (b"[]", b"{}", b'{"format": 1}', b"\xff", b"[" * 100_000)],
    ("capsule.json", b'{"format": "motorcade-capsule/1", "versions": {"motorcade": "1"}, "checkpoints": 1000000000}'),
    ("capsule.json", b'{"format": "motorcade-capsule/1", "versions": {"motorcade": "1"}, "checkpoints": -1}'),
    ("capsule.json", b'{"format": "motorcade-capsule/1", "versions": {}, "checkpoints": 1}'),
    *[("sweep.toml", content) for content in (b"", b"\xff", b"x = " + b"[" * 100_000)],
    *[
        ("programs/0.profile.json", content)
        for content in (b"[]", b"{}", b'{"name": 1, "profile": []}', b"[" * 100_000)
    ],
    *[("programs/0.image", content) for content in (b"", b"x" * 3000)],
    *[("mats/0.json", content) for content in (b"[]", b"{}", b"null", b"[" * 100_000)],
    *[("table.parquet", content) for content in (b"", b"PAR1", b"PAR1" + bytes(100) + b"PAR1")],
    ("table.parquet", table_of(pa.array([1] * 6))),
    ("table.parquet", table_of(pa.array([b"x"] * 5))),
    ("table.parquet", table_of(pa.array([[b"x"]] * 6))),
)


@pytest.mark.parametrize(("part", "content"), STRANGE)
def test_what_is_made_up_in_a_capsule_is_a_sentence(capsule, tmp_path, part, content):
    made = changed(capsule, tmp_path, {part: lambda data: content})
    with pytest.raises(MotorcadeError) as caught:
        verify(made, None, nobody, None)
    assert all(caught.value.sentence(language) for language in ("en", "zh"))


@pytest.mark.parametrize("digests", [[None] * 6, [b""] * 6, [b"x" * 3] * 6, [b"x" * 100_000] * 6])
def test_digests_of_another_length_are_a_difference(capsule, tmp_path, digests):
    made = changed(capsule, tmp_path, {"table.parquet": lambda data: table_of(pa.array(digests, pa.binary()))})
    assert json.loads(run("verify", made, "--json").out)["equal"] is False
