"""`motorcade site`: what it writes, and into which folders."""

import gzip
import hashlib
import io
import json
import os
import re
import shlex
import sys
import zipfile
from base64 import b64encode

import pytest
from filelock import FileLock
from scripts.studio_process import build_page

from motorcade.browser.site import LIST, site_files, write_site
from motorcade.errors import MotorcadeError
from support.command_line import run

# A site of few files, for tests of the folder.
FEW = {"assets/a.js": b"a", "index.html": b"page", "start/x.json": b"{}"}
MOST_BYTES = 12_000_000


@pytest.fixture(scope="module")
def files(page_lock: FileLock) -> dict[str, bytes]:
    with page_lock:
        build_page()
    return site_files()


def names_in(folder) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def test_the_service_worker_is_a_plain_script_that_lists_every_other_file_with_its_hash(files):
    entries = {each["url"]: each for each in json.loads(re.search(rb'\[\{"url".*?\}\]', files["sw.js"])[0])}
    assert set(entries) == set(files) - {"sw.js"}
    # Firefox runs no service worker that is a module.
    assert re.search(rb"\b(import|export)\b *[\"'{(*]", files["sw.js"]) is None
    for name, entry in entries.items():
        assert entry["integrity"] == "sha256-" + b64encode(hashlib.sha256(files[name]).digest()).decode()


def test_the_page_asks_for_files_of_the_site_alone_and_by_relative_addresses(files):
    page = files["index.html"].decode()
    addresses = re.findall(r'(?:src|href)="([^"]*)"', page)
    assert addresses
    assert [each for each in addresses if each.removeprefix("./") not in files] == []
    for style in (data.decode() for name, data in files.items() if name.endswith(".css")):
        assert re.findall(r"url\((?!\"?(?:data:|\./|[a-z]))[^)]*\)", style) == []


def test_modules_of_a_start_come_as_bytecode_which_python_compares_with_their_sources(files):
    """A browser that compiles them itself takes twice as long until the first Play."""
    archives = {name.rpartition("/")[2]: data for name, data in files.items() if name.endswith(".zip")}
    with zipfile.ZipFile(io.BytesIO(archives["python_stdlib.zip"])) as library:
        assert {"os.pyc", "dataclasses.pyc", "encodings/utf_8.pyc", "_compat_pickle.py"} <= set(library.namelist())
    with zipfile.ZipFile(io.BytesIO(archives["bytecode.zip"])) as packages:
        headers = {name: packages.read(name)[:16] for name in packages.namelist()}
    assert {
        "msgspec/__pycache__/structs.cpython-314.pyc",
        "motorcade/browser/__pycache__/shell.cpython-314.pyc",
    } <= set(headers)
    # PEP 552: 1 is bytecode with its source's hash, 2 that Python compares it.
    assert {header[4] for header in headers.values()} == {3}


def test_no_page_of_a_server_is_in_it(files):
    assert [name for name in files if name.endswith(".html")] == ["index.html"]


def test_a_first_visit_is_small(files):
    """By gzip, which every web server has; a picture or an archive isn't compressed once more."""
    sent = {
        name: data if name.endswith((".png", ".zip", ".whl")) else gzip.compress(data, 6)
        for name, data in files.items()
    }
    assert sum(map(len, sent.values())) < MOST_BYTES


def test_the_page_asks_at_once_for_few_files_and_for_all_that_its_stage_needs(files):
    """Each file more is a way to the server and back, and so is each that is known only when another has come."""
    asked = set(re.findall(r'(?:src|href)="\./(assets/[^"]*\.(?:js|css))"', files["index.html"].decode()))
    assert any("/stage-" in name for name in asked)
    assert len(asked) <= 20
    imported = {
        f"assets/{name}"
        for script in asked
        if script.endswith(".js")
        for name in re.findall(r'(?:from|import)[`"]\./([^`"]+)[`"]', files[script].decode())
    }
    assert imported
    assert imported - asked == set()


def test_python_of_another_build_has_another_address(files, monkeypatch):
    """So a page never gets it, whatever caches and servers do meanwhile."""
    monkeypatch.setattr("motorcade.browser.site.python_zip", lambda: b"other")
    changed = site_files()
    folder = rb'name="motorcade-python" content="(python-[0-9a-f]{12}/)"'
    old, new = (re.findall(folder, each["index.html"])[0].decode() for each in (files, changed))
    assert f"{old}python.zip" in files
    assert f"{new}python.zip" in changed
    assert old != new
    assert {name for name in changed if files.get(name) != changed[name] and new not in name} == {"index.html", "sw.js"}


def test_the_command_writes_the_site_the_same_bytes_each_time_and_says_how_to_try_it(files, tmp_path):
    folder = tmp_path / "new" / "my pupils' site"
    done = run("site", "-o", folder)
    assert done.code == 0, done.err
    assert names_in(folder) == {LIST, *files}
    assert all((folder / name).read_bytes() == data for name, data in files.items())
    if os.name != "nt":
        assert shlex.split(done.out.rpartition(": ")[2])[-2:] == ["--directory", str(folder)]


def test_json_says_where_it_is_and_how_many_files_it_has(tmp_path, monkeypatch):
    monkeypatch.setattr("motorcade.browser.site.site_files", lambda: FEW)
    told = json.loads(run("site", "-o", tmp_path, "--json").out)
    assert told == {"folder": str(tmp_path), "files": len(FEW), "bytes": 7}


def test_an_older_site_is_replaced_with_all_its_files(tmp_path):
    write_site(tmp_path, {**FEW, "assets/old/gone.js": b"old"})
    write_site(tmp_path, {**FEW, "index.html": b"newer"})
    assert names_in(tmp_path) == {LIST, *FEW}
    assert not (tmp_path / "assets" / "old").exists()
    assert (tmp_path / "index.html").read_bytes() == b"newer"


def test_files_of_others_are_kept_and_named(tmp_path):
    (tmp_path / "homework.txt").write_text("mine")
    with pytest.raises(MotorcadeError, match=r"homework\.txt"):
        write_site(tmp_path, FEW)
    assert names_in(tmp_path) == {"homework.txt"}


def test_a_list_that_names_files_outside_the_folder_removes_none(tmp_path):
    site, outside = tmp_path / "site", tmp_path / "precious.txt"
    outside.write_text("mine")
    write_site(site, FEW)
    document = json.loads((site / LIST).read_text())
    document["files"]["../precious.txt"] = ""
    (site / LIST).write_text(json.dumps(document))
    write_site(site, FEW)
    assert outside.read_text() == "mine"


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX's links")
@pytest.mark.parametrize("name", sorted(FEW))
def test_a_link_in_place_of_a_sites_file_is_not_followed(tmp_path, name):
    site, outside = tmp_path / "site", tmp_path / "precious.txt"
    outside.write_text("mine")
    write_site(site, FEW)
    (site / name).unlink()
    (site / name).symlink_to(outside)
    write_site(site, FEW)
    assert outside.read_text() == "mine"
    assert not (site / name).is_symlink()


@pytest.mark.parametrize("document", ["", "[]", "{}", '{"format": "motorcade-site/1", "files": 3}', '{"files": {}}'])
def test_a_damaged_list_counts_as_none(tmp_path, document):
    (tmp_path / LIST).write_text(document)
    with pytest.raises(MotorcadeError, match=re.escape(LIST)):
        write_site(tmp_path, FEW)


@pytest.mark.parametrize("stopped_at", FEW)
def test_what_an_interrupted_call_leaves_is_no_site_and_is_taken_up(tmp_path, stopped_at):
    class Interrupting(dict):
        def __getitem__(self, name):
            if name == stopped_at:
                raise KeyboardInterrupt
            return super().__getitem__(name)

    write_site(tmp_path, {**FEW, "index.html": b"older"})
    with pytest.raises(KeyboardInterrupt):
        write_site(tmp_path, Interrupting(FEW))
    assert not (tmp_path / "index.html").exists()
    write_site(tmp_path, FEW)
    assert names_in(tmp_path) == {LIST, *FEW}


@pytest.mark.parametrize("place", ["file", "file/site"])
def test_a_file_in_the_way_is_named(tmp_path, place):
    (tmp_path / "file").write_text("mine")
    with pytest.raises(MotorcadeError, match=re.escape(str(tmp_path / place))):
        write_site(tmp_path / place, FEW)
    assert (tmp_path / "file").read_text() == "mine"


def test_a_folder_in_the_way_of_a_file_is_named(tmp_path):
    (tmp_path / "index.html").mkdir()
    with pytest.raises(MotorcadeError, match=r"index\.html"):
        write_site(tmp_path, FEW)


def test_a_page_that_is_not_built_is_said(tmp_path):
    with pytest.raises(MotorcadeError, match="make page"):
        site_files(tmp_path)
