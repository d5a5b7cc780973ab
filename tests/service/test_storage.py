"""Every storage of projects: a folder on disk and a browser's store have the same rules, and exchange files."""

import itertools
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.server.studio.library import FolderStorage
from motorcade.service.library import DEFAULT_LIMITS, LONGEST_NAME, Limits, export_all, import_all
from support.browser_store import MockStore, MockTab, refusal, save

NAMES = ["CON", "...", "50% faster", "名字", "👩\u200d🚀 rocket", "🚗" * LONGEST_NAME, "deleted"]


@pytest.fixture(params=["folder", "browser"])
def make_storage(request, tmp_path):
    """Make empty storages of one kind, each with the limits given."""
    numbers = itertools.count()

    def make(limits=DEFAULT_LIMITS):
        if request.param == "folder":
            return FolderStorage(tmp_path / str(next(numbers)), limits)
        return MockTab(MockStore(), limits)

    return make


@pytest.fixture
def storage(make_storage):
    return make_storage()


def read(storage, name, version=None):
    return storage.read("", name, version)


def names(storage):
    return sorted(entry.name for entry in storage.list(""))


def test_every_version_is_stored_and_can_be_restored(storage):
    assert [save(storage, "a", text) for text in ("one", "two", "three")] == [1, 2, 3]
    assert [save.version for save in storage.history("", "a")] == [3, 2, 1]
    assert [read(storage, "a", version) for version in (None, 3, 2, 1)] == [b"three", b"three", b"two", b"one"]
    assert save(storage, "a", read(storage, "a", 1).decode()) == 4
    assert read(storage, "a") == b"one"


def test_an_unchanged_project_is_not_a_new_version(storage):
    assert [save(storage, "a", text) for text in ("one", "one", "two", "one")] == [1, 1, 2, 3]


def test_a_new_storage_is_empty(storage):
    assert storage.list("") == []
    assert refusal(storage.read, "", "a") == "no-project"
    assert refusal(storage.history, "", "a") == "no-project"
    assert refusal(storage.delete, "", "a") == "no-project"


def test_names_in_any_language_are_stored(storage):
    for name in (*NAMES, "Dance", "dance"):
        save(storage, name, f"of {name}")
    assert names(storage) == sorted((*NAMES, "Dance", "dance"))
    assert [read(storage, name).decode() for name in NAMES] == [f"of {name}" for name in NAMES]


def test_unicode_forms_of_a_name_are_one_name(storage):
    save(storage, "Caf\u00e9", "one")
    assert save(storage, "Cafe\u0301 ", "two") == 2
    assert names(storage) == ["Caf\u00e9"]
    assert read(storage, "Cafe\u0301", 1) == b"one"
    storage.delete("", " Cafe\u0301")
    assert names(storage) == []


@pytest.mark.parametrize(
    "name", ["", " ", ".", "..", "../x", "a/b", "a\\b", "a\nb", "a\0b", "a\u202eb", "\ud800", "x" * 61]
)
def test_an_invalid_name_is_refused(storage, name):
    for call in (storage.read, storage.history, storage.delete):
        assert refusal(call, "", name) == "bad-project-name"
    assert refusal(save, storage, name, "x") == "bad-project-name"
    assert names(storage) == []


def test_a_missing_version_is_refused(storage):
    save(storage, "a", "one")
    for version in (0, 2, -1, 10**8):
        assert refusal(storage.read, "", "a", version) == "no-version"


def test_a_version_made_from_an_older_one_is_refused(storage):
    assert save(storage, "a", "one", base=0) == 1
    assert save(storage, "a", "two", base=1) == 2
    for base, code in ((0, "project-exists"), (1, "saved-elsewhere"), (3, "saved-elsewhere")):
        assert refusal(save, storage, "a", "other", base=base) == code
    assert save(storage, "a", "two", base=1) == 2
    assert save(storage, "a", "three", base=2) == 3
    assert [read(storage, "a", version) for version in (1, 2, 3)] == [b"one", b"two", b"three"]


def test_the_time_of_an_imported_version_stays(storage):
    save(storage, "a", "one", saved_at_s=109.5)
    assert [entry.saved_at for entry in storage.list("")] == ["1970-01-01T00:01:49.500+00:00"]


def test_owners_do_not_see_each_other(storage):
    for owner in ("", "ann", "bob"):
        storage.write_version(owner, "a", f"of {owner}".encode())
        storage.add_stars(owner, "square", [len(owner)])
    assert [storage.read(owner, "a") for owner in ("", "ann", "bob")] == [b"of ", b"of ann", b"of bob"]
    assert storage.stars("ann") == {"square": [3]}
    storage.delete("ann", "a")
    assert [len(storage.list(owner)) for owner in ("", "ann", "bob")] == [1, 0, 1]


def test_stars_are_united(storage):
    assert storage.add_stars("", "square", [2]) == [2]
    assert storage.add_stars("", "square", [1, 2]) == [1, 2]
    assert storage.add_stars("", "herd", []) == []
    assert storage.stars("") == {"square": [1, 2]}


def test_an_owner_has_a_bounded_number_of_projects(make_storage):
    storage = make_storage(Limits(projects=2))
    for name in ("a", "b"):
        save(storage, name, "1")
    assert refusal(save, storage, "c", "1") == "too-many-projects"
    save(storage, "a", "2")
    storage.delete("", "b")
    save(storage, "c", "1")
    storage.write_version("another pupil", "d", b"1")
    assert names(storage) == ["a", "c"]


def test_an_owner_stores_a_bounded_number_of_bytes(make_storage):
    storage = make_storage(Limits(size_bytes=100))
    save(storage, "a", "x" * 60)
    assert refusal(save, storage, "b", "x" * 41) in ("library-full", "browser-library-full")
    save(storage, "b", "x" * 40)
    assert names(storage) == ["a", "b"]


def test_of_a_project_the_newest_versions_are_kept(make_storage):
    storage = make_storage(Limits(versions=3))
    for number in range(1, 6):
        save(storage, "a", f"text {number}")
    assert [each.version for each in storage.history("", "a")] == [5, 4, 3]
    assert read(storage, "a", 3) == b"text 3"


def project(text):
    """A project file that differs by ``text``."""
    return json.dumps({"format": "motorcade-program/1", "leader": [], "view": {"python": text}})


def versions_in(storage):
    """All texts by project, the oldest version first."""
    return {
        name: [read(storage, name, each.version).decode() for each in reversed(storage.history("", name))]
        for name in names(storage)
    }


def run(storage, request):
    """Do several calls of a storage as one request."""
    return storage.run(request) if isinstance(storage, MockTab) else request(storage)


def exported(storage):
    return run(storage, lambda each: export_all(each, "")).text


def imported(storage, text):
    return run(storage, lambda each: import_all(each, "", text))


def fill(storage, **projects):
    for name, texts in projects.items():
        for number, text in enumerate(texts):
            save(storage, name, project(text), saved_at_s=1000.0 + number)


def test_all_projects_go_to_another_storage_in_one_file(make_storage):
    one, other = make_storage(), make_storage()
    fill(one, a=["1", "2", "3"], b=["x"])
    one.add_stars("", "square", [1, 3])
    report = imported(other, exported(one))
    assert [(each.name, each.stored_as, each.versions) for each in report.projects] == [("a", "a", 3), ("b", "b", 1)]
    assert (report.stars, report.left_out) == (2, [])
    assert versions_in(other) == versions_in(one)
    assert other.history("", "a") == one.history("", "a")
    assert other.stars("") == {"square": [1, 3]}


texts = st.lists(st.sampled_from("abc"), max_size=3)
libraries = st.dictionaries(st.sampled_from(["p", "q", "x" * LONGEST_NAME]), texts, max_size=2)


@given(libraries, libraries)
def test_an_import_loses_nothing_and_adds_nothing_the_second_time(mine, other):
    one, two = MockTab(MockStore()), MockTab(MockStore())
    fill(one, **mine)
    fill(two, **other)
    before, file = versions_in(one), exported(two)
    imported(one, file)
    after = versions_in(one)
    for name, versions in before.items():
        assert after[name][: len(versions)] == versions
    for name, versions in versions_in(two).items():
        assert any(set(versions) <= set(found) for key, found in after.items() if key.startswith(name[:40]))
    report = imported(one, file)
    assert [each.versions for each in report.projects] == [0] * len(report.projects)
    assert versions_in(one) == after


def test_a_different_project_of_the_same_name_gets_a_new_name(make_storage):
    one, other = make_storage(), make_storage()
    fill(one, a=["mine 1", "mine 2"], b=["1"])
    fill(other, a=["theirs"], b=["1", "2"])
    other.add_stars("", "square", [2])
    one.add_stars("", "square", [1])
    report = imported(one, exported(other))
    assert sorted((each.name, each.stored_as, each.versions) for each in report.projects) == [
        ("a", "a (2)", 1),
        ("b", "b (2)", 2),
    ]
    assert versions_in(one) == {
        "a": [project("mine 1"), project("mine 2")],
        "a (2)": [project("theirs")],
        "b": [project("1")],
        "b (2)": [project("1"), project("2")],
    }
    assert (report.stars, one.stars("")) == (1, {"square": [1, 2]})


def file_with(**changes):
    """A file of one project, with another value somewhere."""
    version = {"saved_at": "2026-01-01T00:00:00Z", "text": project("1")} | changes.pop("version", {})
    entry = {"name": "a", "versions": [version]} | changes.pop("project", {})
    return json.dumps({"format": "motorcade-projects/1", "projects": [entry], "stars": {}} | changes)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        project("1"),
        file_with()[:-1],
        "[" * 100_000,
        file_with(format="motorcade-projects/2"),
        file_with(project={"name": "../../etc"}),
        file_with(project={"versions": [7]}),
        file_with(version={"saved_at": "2026-01-01T00:00:00"}),
        file_with(version={"text": "\ud800"}),
    ],
)
def test_a_damaged_file_is_refused_and_changes_nothing(storage, text):
    fill(storage, a=["1"])
    assert refusal(imported, storage, text) == "no-projects-file"
    assert versions_in(storage) == {"a": [project("1")]}


def test_a_version_that_is_no_project_is_left_out(storage):
    bad = {"saved_at": "0001-01-01T00:00:00Z", "text": "<script>"}
    good = {"saved_at": "9999-12-31T23:59:59-12:00", "text": project("1")}
    report = imported(storage, file_with(project={"versions": [bad, good]}, stars={"square": [1, 9, "2"], "../x": [1]}))
    assert report.left_out == ["a"]
    assert versions_in(storage) == {"a": [project("1")]}
    assert storage.list("")[0].saved_at == "2100-01-01T00:00:00.000+00:00"
    assert storage.stars("") == {"square": [1]}
