"""The library on a disk: no saved version is lost, and no name leads out of its folder."""

import os
import shutil
import unicodedata
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Thread

import pytest
from filelock import FileLock
from hypothesis import given
from hypothesis import strategies as st

from motorcade.errors import MotorcadeError
from motorcade.server.studio import library as library_module
from motorcade.server.studio.library import DELETED, FolderStorage, folder_of, name_of
from motorcade.service.library import LONGEST_NAME, Limits
from support.browser_store import refusal, save

# What Windows, macOS and Linux between them can't take as a file's name, or take for something else.
HARD_NAMES = ["CON", "con.motorcade", "COM1.x", "aux.", "...", ".hidden", 'a<b>c:d"e|f?g*h', "50% faster", "%41", "-"]
HARD_NAMES += ["名字", "نام\u200cها", "👩\u200d🚀 rocket", "🚗" * LONGEST_NAME, "?" * LONGEST_NAME, "deleted"]


@pytest.fixture
def disk(tmp_path):
    """The library's folder."""
    return tmp_path / "library"


@pytest.fixture
def library(disk):
    return FolderStorage(disk)


def read(library, name, version=None):
    return library.read("", name, version)


def names(library):
    return [entry.name for entry in library.list("")]


def project_folder(disk, name):
    """The folder of a project that is saved."""
    library = FolderStorage(disk)
    save(library, name, "x")
    assert name in names(library)
    (folder,) = (each for each in disk.iterdir() if name_of(each.name) == name)
    return folder


def test_the_project_saved_last_is_listed_first(disk, library):
    for number, name in enumerate(("old", "new", "middle")):
        save(library, name, "x")
        file = project_folder(disk, name) / "000001.motorcade.json"
        os.utime(file, (100 + (0, 9, 5)[number],) * 2)
    assert names(library) == ["new", "middle", "old"]
    assert library.list("")[0].saved_at == "1970-01-01T00:01:49.000+00:00"
    assert library.list("")[0].versions == 1


@pytest.mark.parametrize("name", HARD_NAMES)
def test_a_name_in_any_language_is_stored_under_a_portable_file_name(disk, library, name):
    folder = project_folder(disk, name)
    assert names(library) == [name]
    assert read(library, name) == b"x"
    assert len(folder.name.encode()) <= 255
    assert not set('<>:"/\\|?*.') & set(folder.name)
    assert folder.parent == disk
    stem = folder.name.partition(".")[0].upper()
    assert stem not in {"CON", "PRN", "AUX", "NUL", *(f"{device}{n}" for device in ("COM", "LPT") for n in range(10))}


@given(st.text(min_size=1, max_size=LONGEST_NAME))
def test_a_name_and_its_folder_determine_each_other(name):
    try:
        folder = folder_of(name)
    except MotorcadeError:
        return
    assert Path(folder).name == folder
    assert name_of(folder) == unicodedata.normalize("NFC", name).strip()


def test_names_that_differ_only_in_case_have_different_folders(disk, library):
    folders = [project_folder(disk, name).name.casefold() for name in ("Dance", "dance", "DANCE")]
    assert len(set(folders)) == 3
    assert sorted(names(library)) == ["DANCE", "Dance", "dance"]


def test_a_folder_has_its_name_also_in_the_form_in_which_a_file_system_may_give_it_back(disk):
    folder = project_folder(disk, "Caf\u00e9")
    assert name_of(unicodedata.normalize("NFD", folder.name)) == "Caf\u00e9"


def test_other_files_in_the_folder_are_ignored(disk, library):
    folder = project_folder(disk, "a")
    save(library, "b", "x")
    (disk / "notes.txt").write_text("x")
    (disk / "a-00000000").mkdir()
    (disk / "%FF-12345678").mkdir()
    (disk / "empty").mkdir()
    (folder / "000002.motorcade.json").mkdir()
    (folder / "000003.motorcade.json").touch()
    (folder / "copy of 000001.motorcade.json").write_text("x")
    (folder / "1.motorcade.json").write_text("x")
    (folder / "000009.motorcade.json").symlink_to(folder / "nowhere")
    assert sorted(names(library)) == ["a", "b"]
    assert [save.version for save in library.history("", "a")] == [1]
    assert read(library, "a") == b"x"
    assert save(library, "a", "y") == 4


def test_a_failed_save_leaves_the_older_versions(library, monkeypatch):
    save(library, "a", "one")

    def full(path, data):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(library_module, "replace_file", full)
    with pytest.raises(MotorcadeError, match="the disk is full") as refused:
        save(library, "a", "two")
    assert refused.value.code == "cant-save"
    assert read(library, "a") == b"one"
    monkeypatch.undo()
    assert read(library, "a", save(library, "a", "two")) == b"two"


def test_parallel_saves_lose_nothing(tmp_path):
    texts = [f"save {number}" for number in range(60)]
    libraries = [FolderStorage(tmp_path), FolderStorage(tmp_path)]
    with ThreadPoolExecutor(8) as pool:
        versions = list(pool.map(lambda each: save(libraries[each[0] % 2], "a", each[1]), enumerate(texts)))
    assert len(set(versions)) == 60
    assert [read(libraries[0], "a", version).decode() for version in versions] == texts


def test_saves_at_the_same_moment_get_different_numbers(tmp_path, monkeypatch):
    """Both look for the newest version before either writes."""
    one, other = FolderStorage(tmp_path), FolderStorage(tmp_path)
    check_base = library_module.check_base

    def late(*arguments):
        monkeypatch.setattr(library_module, "check_base", check_base)
        assert save(other, "a", "other") == 1
        check_base(*arguments)

    monkeypatch.setattr(library_module, "check_base", late)
    assert save(one, "a", "one") == 2
    assert (read(one, "a", 1), read(one, "a", 2)) == (b"other", b"one")
    monkeypatch.setattr(library_module, "check_base", late)
    other.delete("", "a")
    assert refusal(lambda: one.write_version("", "a", b"one", base=0)) == "project-exists"
    assert read(one, "a") == b"other"


def test_a_deleted_project_is_moved_to_a_folder(disk, library):
    for text in ("one", "two"):
        save(library, "a", text)
        library.delete("", "a")
        assert library.list("") == []
    kept = sorted((disk / DELETED).rglob("*.motorcade.json"))
    assert [file.read_text() for file in kept] == ["one", "two"]
    assert save(library, "a", "three") == 1


def test_a_project_is_deleted_whatever_stands_in_the_way_and_once_by_two_at_once(disk, library, monkeypatch):
    for number in range(3):
        save(library, "a", str(number))
        library.delete("", "a")
    # The user has thrown the first one away.
    (first,) = (disk / DELETED).glob("a-*.1")
    shutil.rmtree(first)
    for text in ("again", "and again"):
        save(library, "a", text)
        library.delete("", "a")
    assert len(list((disk / DELETED).iterdir())) == 4
    shutil.rmtree(disk / DELETED)
    (disk / DELETED).write_text("a file of the user")
    save(library, "a", "kept")
    library.delete("", "a")
    assert library.list("") == []
    assert [file.read_text() for file in disk.rglob("*.motorcade.json")] == ["kept"]
    save(library, "b", "x")
    rename = Path.rename

    def late(folder, to):
        monkeypatch.undo()
        FolderStorage(disk).delete("", "b")
        return rename(folder, to)

    monkeypatch.setattr(Path, "rename", late)
    assert refusal(library.delete, "", "b") == "no-project"


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="needs a folder that can't be written to")
def test_a_read_only_folder_is_an_error(disk, library):
    save(library, "a", "one")
    disk.chmod(0o500)
    assert refusal(save, library, "b", "x") == "cant-save"
    assert refusal(library.delete, "", "a") == "cant-delete"
    disk.chmod(0o700)


def test_what_was_stored_before_the_start_and_deleted_counts_too(tmp_path):
    library = FolderStorage(tmp_path, Limits(size_bytes=100))
    save(library, "a", "x" * 60)
    library.delete("", "a")
    library = FolderStorage(tmp_path, Limits(size_bytes=100))
    assert refusal(save, library, "b", "x" * 41) == "library-full"
    save(library, "b", "x" * 40)
    assert names(library) == ["b"]


def test_two_servers_that_store_stars_at_the_same_time_lose_none(tmp_path, monkeypatch):
    """The second one begins while the first, which has read what there is, writes."""
    one, other = FolderStorage(tmp_path), FolderStorage(tmp_path)
    second = Thread(target=other.add_stars, args=("", "herd", [3]))
    write = library_module.replace_file

    def while_another_writes(file, data):
        monkeypatch.setattr(library_module, "replace_file", write)
        second.start()
        # It ends only without a lock.
        second.join(0.2)
        write(file, data)

    monkeypatch.setattr(library_module, "replace_file", while_another_writes)
    one.add_stars("", "square", [1])
    second.join()
    assert one.stars("") == {"square": [1], "herd": [3]}
    assert one.list("") == []


def test_a_lock_that_nobody_gives_back_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr(library_module, "LONGEST_WAIT_S", 0)
    with FileLock(tmp_path / library_module.STARS_LOCK), pytest.raises(MotorcadeError) as caught:
        FolderStorage(tmp_path).add_stars("", "square", [1])
    assert caught.value.code == "cant-save"
    assert caught.value.sentence("zh")
