"""Projects in a browser's store: several tabs, a store that refuses, and what is damaged in it."""

import json

import pytest

from motorcade.program.compiler import compile_program
from motorcade.program.model import Program
from motorcade.program.steps import forward
from motorcade.service.library import Limits, export_all
from support.browser_store import MockStore, MockTab, refusal, save

IMAGE = compile_program(Program([forward(1)])).image


@pytest.fixture
def store():
    return MockStore()


@pytest.fixture
def tab(store):
    return MockTab(store)


def test_what_one_tab_saves_is_there_for_the_next(store, tab):
    save(tab, "a", "one")
    tab.add_stars("", "square", [1])
    tab.storage.store_car_image(IMAGE)
    store.keep_car(tab.storage.take_car_image())
    later = MockTab(store)
    assert later.read("", "a") == b"one"
    assert later.stars("") == {"square": [1]}
    assert later.run(lambda storage: storage.car_image()) == IMAGE


def test_tabs_that_save_at_the_same_moment_lose_nothing(store, tab):
    other = MockTab(store)
    save(tab, "a", "one")
    store.before_commit = lambda: save(other, "a", "two")
    assert save(tab, "a", "three") == 3
    store.before_commit = lambda: other.add_stars("", "square", [1])
    assert tab.add_stars("", "square", [2]) == [1, 2]
    store.before_commit = lambda: save(other, "a", "four")
    assert refusal(save, tab, "a", "five", base=3) == "saved-elsewhere"
    assert [tab.read("", "a", version) for version in (1, 2, 3, 4)] == [b"one", b"two", b"three", b"four"]
    assert tab.history("", "a") == other.history("", "a")


def test_the_image_of_the_virtual_car_is_stored_whatever_other_tabs_do(store, tab):
    other = MockTab(store)
    tab.list("")
    tab.storage.store_car_image(IMAGE)
    save(other, "a", "x")
    store.keep_car(tab.storage.take_car_image())
    assert tab.storage.take_car_image() == ""
    assert tab.run(lambda storage: storage.car_image()) == IMAGE
    assert other.run(lambda storage: storage.car_image()) == IMAGE
    assert save(tab, "a", "y") == 2


@pytest.mark.parametrize("why", ["full", "newer", "damaged"])
def test_a_refused_change_leaves_all_as_it_was(store, tab, why):
    save(tab, "a", "one")
    store.refuses = why
    for change in (
        lambda: save(tab, "a", "two"),
        lambda: save(tab, "b", "x"),
        lambda: tab.delete("", "a"),
        lambda: tab.add_stars("", "square", [1]),
    ):
        assert refusal(change) == f"browser-store-{why}"
    assert [entry.name for entry in tab.list("")] == ["a"]
    assert tab.stars("") == {}
    store.refuses = ""
    assert [save(tab, "a", "two"), tab.read("", "a")] == [2, b"two"]


def test_a_request_that_changes_nothing_stores_nothing(store, tab):
    save(tab, "a", "one")
    commits = store.commits
    tab.list("")
    tab.history("", "a")
    tab.read("", "a")
    save(tab, "a", "one")
    assert refusal(tab.delete, "", "b") == "no-project"
    assert store.commits == commits


def test_a_damaged_text_is_refused_and_the_others_can_be_read(store, tab):
    for text in ("one", "two", "three", "four"):
        save(tab, "a", text)
    _, second, third, fourth = store.texts
    store.texts[second] = "something else"
    store.texts[third] = None
    store.texts[fourth] = {"an": "object"}
    for version in (2, 3, 4):
        assert refusal(tab.read, "", "a", version) == "damaged-version"
    assert tab.read("", "a", 1) == b"one"
    exported = tab.run(lambda storage: export_all(storage, ""))
    assert [each.version for each in exported.left_out] == [2, 3, 4]
    assert [each["text"] for each in json.loads(exported.text)["projects"][0]["versions"]] == ["one"]
    assert [save(tab, "a", "five"), tab.read("", "a")] == [5, b"five"]


@pytest.mark.parametrize(
    "key",
    [
        ("", "b", 1),
        ("", "b", "1", 0, 1, "x"),
        (1, "b", 1, 0, 1, "x"),
        ("", "b", [], 0, 1, "x"),
        ("", "b/", 1, 0, 1, "x"),
    ],
)
def test_a_damaged_record_is_named_and_all_others_are_listed(store, tab, key):
    save(tab, "a", "one")
    store.texts[key if not isinstance(key[2], list) else ("", "b")] = "x"
    store.values["stars/"] = {"square": [1], "herd": "x", "/": [2]}
    later = MockTab(store)
    assert [entry.name for entry in later.list("")] == ["a"]
    assert later.read("", "a") == b"one"
    (problem,) = later.place().problems
    assert problem.code == "damaged-record"
    assert "'b" in problem.sentence["en"]
    assert later.stars("") == {"square": [1], "herd": []}
    assert save(later, "c", "x") == 1


@pytest.mark.parametrize("problem", ["missing", "newer", "damaged"])
def test_a_store_that_cannot_be_opened_is_told(store, tab, problem):
    store.problem = problem
    place = tab.place()
    assert not place.stays
    assert [each.code for each in place.problems] == [f"browser-store-{problem}"]
    assert save(tab, "a", "one") == 1


@pytest.mark.parametrize("image", [7, "not base64!", None, "AQI="])
def test_a_damaged_image_of_the_virtual_car_is_none(store, tab, image):
    store.values["virtual-car"] = image
    assert tab.run(lambda storage: storage.car_image()) is None


def test_many_texts_take_few_runs(store):
    tab = MockTab(store, Limits())
    for number in range(30):
        save(tab, f"p{number % 3}", f"text {number}")
    tab.runs = 0
    assert len(tab.run(lambda storage: export_all(storage, "")).text) > 30
    assert tab.runs <= 3
