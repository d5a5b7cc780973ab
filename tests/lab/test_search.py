"""Searches for programs: their archive, how they go on, and what they find."""

import json
import sys
from contextlib import contextmanager
from random import Random

import pytest

from motorcade.errors import MotorcadeError
from motorcade.lab.programs import ProgramSource
from motorcade.lab.search import Search, do_task, opened_archive
from motorcade.missions.check import check_program
from motorcade.missions.document import built_in_mission, mission_of
from motorcade.program.compiler import compile_program
from motorcade.program.files import read_project
from motorcade.program.model import placed_steps
from motorcade.service.documents import open_file
from support.made_up_runs import ZONE, mission

METHODS = ("map-elites", "racing", "random")
# Two cars, for 4 s: the follower must get into the zone in front of it, and a run takes a millisecond.
QUICK = {
    "format": "motorcade-mission/1",
    "name": "quick",
    "seconds": 4,
    "seeds": [0, 1],
    "steps": ["drive", "wait", "together", "led"],
    "mat": {"size_m": [4, 4], "tick_ms": 20, "car": [{"at_m": [1, 2], "role": "leader"}, {"at_m": [2, 2]}]},
    "zone": [{"name": "home", "centre_m": [2.5, 2], "radius_m": 0.2}],
    "goal": [{"kind": "in-zone", "who": [1], "zone": "home"}, {"star": 2, "kind": "words-at-most", "count": 2}],
}
RUNS = 400


class StopError(Exception):
    """What ends a search in its middle."""


def here(search, numbers, most=None):
    """Workers that do each batch at once."""
    return from_last(search, numbers, most, at_once=1)


def from_last(search, numbers, most=None, at_once=3):
    """Workers that do several batches, and give back the last one first."""
    waiting, done = [], 0
    while True:
        while len(waiting) < at_once and (number := next(numbers, None)) is not None:
            waiting.append((number, search.task(number)))
        if not waiting:
            return
        number, task = waiting.pop()
        if done == most:
            raise StopError
        done += 1
        yield number, do_task(task)


def quick():
    return mission_of(json.loads(json.dumps(QUICK)), "quick")


def searched(folder, method="map-elites", workers=here, runs=RUNS, seed=0):
    search = Search(quick(), method, runs, seed)
    with opened_archive(folder, search.contents) as archive:
        search.run(archive, workers)
    return search


@contextmanager
def refused(code):
    with pytest.raises(MotorcadeError) as problem:
        yield problem
    assert problem.value.code == code
    assert "{" not in str(problem.value)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """A finished search of each method: its folder and itself."""
    folders = {method: tmp_path_factory.mktemp(method) for method in METHODS}
    return {method: (folder, searched(folder, method)) for method, folder in folders.items()}


@pytest.mark.parametrize("method", METHODS)
def test_the_best_programs_are_projects_whose_grade_the_check_confirms(found, method, tmp_path):
    search = found[method][1]
    assert RUNS <= search.done < RUNS + 32
    saved = search.save_best(tmp_path)
    assert len(saved) == 3
    for path, candidate in saved:
        program = read_project(path.read_bytes(), path)[0]
        assert program == candidate.program
        assert check_program(search.mission, program).grade == pytest.approx(candidate.mean.grade, abs=1e-12)
        assert open_file(path.read_text(encoding="utf-8")).mat["size_m"] == [4, 4]
    grades = [candidate.mean.grade for _, candidate in saved]
    assert grades == sorted(grades, reverse=True)


def test_a_search_that_learns_solves_what_drawing_at_random_solves_later(found):
    assert found["map-elites"][1].shortest().blocks in range(2, 6)
    best = {method: search.best.ranked()[0].quality for method, (_, search) in found.items()}
    assert best["map-elites"] >= best["random"]
    assert best["racing"] >= best["random"]


@pytest.mark.parametrize("method", METHODS)
def test_the_archive_does_not_depend_on_the_workers_or_on_a_stop(found, method, tmp_path):
    whole = (found[method][0] / "archive.jsonl").read_bytes()
    with pytest.raises(StopError):
        searched(tmp_path, method, lambda *given: from_last(*given, most=5))
    archive = tmp_path / "archive.jsonl"
    # A killed process leaves a part of a line.
    archive.write_bytes(archive.read_bytes() + whole[-40:-1])
    searched(tmp_path, method, from_last)
    assert archive.read_bytes() == whole


def test_more_runs_go_on_from_the_archive_and_fewer_read_a_part_of_it(found, tmp_path):
    whole = (found["map-elites"][0] / "archive.jsonl").read_bytes()
    searched(tmp_path, runs=100)
    begun = (tmp_path / "archive.jsonl").read_bytes()
    assert searched(tmp_path).done == found["map-elites"][1].done
    assert (tmp_path / "archive.jsonl").read_bytes() == whole
    assert whole.startswith(begun)
    assert searched(tmp_path, runs=100).done < 132
    assert (tmp_path / "archive.jsonl").read_bytes() == whole


def test_a_damaged_archive_is_named_with_its_line(found, tmp_path):
    whole = (found["random"][0] / "archive.jsonl").read_bytes()
    lines = whole.splitlines(keepends=True)
    draw = Random(3)
    for _ in range(30):
        damaged = bytearray(whole)
        at = draw.randrange(len(whole) - len(lines[-1]))
        damaged[at] ^= 1 << draw.randrange(7)
        (tmp_path / "archive.jsonl").write_bytes(damaged)
        with refused("search-archive-damaged"):
            searched(tmp_path, "random")
    # Lines that are whole, but not in their places.
    (tmp_path / "archive.jsonl").write_bytes(b"".join([lines[0], *reversed(lines[1:])]))
    with refused("search-archive-damaged"):
        searched(tmp_path, "random")


@pytest.mark.parametrize(("options", "why"), [({"method": "racing"}, "--method"), ({"seed": 1}, "--seed")])
def test_an_archive_of_another_search_is_refused(found, tmp_path, options, why):
    (tmp_path / "archive.jsonl").write_bytes((found["map-elites"][0] / "archive.jsonl").read_bytes())
    with refused("archive-of-another-search") as problem:
        searched(tmp_path, **options)
    assert why in str(problem.value)


def test_an_archive_of_another_mission_is_refused(found, tmp_path):
    (tmp_path / "archive.jsonl").write_bytes((found["map-elites"][0] / "archive.jsonl").read_bytes())
    other = Search(built_in_mission("pass-it-on"), "map-elites", 10)
    with refused("archive-of-another-search"), opened_archive(tmp_path, other.contents):
        pass


def test_two_searches_in_one_folder_are_refused(tmp_path):
    with opened_archive(tmp_path, {}), refused("search-is-running"), opened_archive(tmp_path, {}):
        pass


def test_a_budget_of_0_and_a_mission_whose_runs_change_nothing_are_refused():
    with refused("search-without-runs"):
        Search(quick(), "random", 0)
    static = mission({"kind": "words-at-most", "count": 1}, {"kind": "seconds-at-most", "seconds": 3, "star": 2})
    with refused("mission-not-gradable"):
        Search(static, "random", 10)
    Search(mission(ZONE), "random", 10)


@pytest.mark.parametrize("name", ["the-square", "find-the-road", "aac", "three-laps", "the-last-car", "hide-and-seek"])
def test_programs_are_of_the_missions_blocks_and_differ(name):
    wanted = built_in_mission(name)
    source, random = ProgramSource(wanted), Random(1)
    drawn = [source.draw(random) for _ in range(100)]
    changed = [source.change(random, program) for program in drawn]
    images = {compile_program(program, wanted.profile).image for program in (*drawn, *changed)}
    assert len(images) == 200
    kinds = {kind for program in (*drawn, *changed) for kind in _kinds(program)}
    assert kinds <= set(wanted.palette)
    assert len(kinds) > len(wanted.palette) / 2


def test_a_change_makes_a_program_longer_or_shorter_or_leaves_its_length():
    source, random = ProgramSource(built_in_mission("the-square")), Random(1)
    drawn = [source.draw(random) for _ in range(100)]
    lengths = [(len([*placed_steps(each)]), len([*placed_steps(source.change(random, each))])) for each in drawn]
    more, fewer = (sum(sign * after > sign * before for before, after in lengths) for sign in (1, -1))
    assert min(more, fewer, 100 - more - fewer) > 10


def _kinds(program):
    return {step.kind for _, step in placed_steps(program)}


def test_the_picture_shows_the_archive(found, tmp_path):
    picture = tmp_path / "archive.png"
    found["map-elites"][1].best.draw(picture, "Quick")
    assert picture.stat().st_size > 3000


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX's links")
def test_the_picture_follows_no_link_that_somebody_has_put_there(found, tmp_path):
    picture, precious = tmp_path / "archive.png", tmp_path / "precious"
    precious.write_text("mine")
    picture.symlink_to(precious)
    found["map-elites"][1].best.draw(picture, "Quick")
    assert precious.read_text() == "mine"
