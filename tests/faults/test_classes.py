"""Classes in the simulated room: their promises, and who has sent each request of a class."""

from functools import cache

import pytest
from starlette.routing import Route, WebSocketRoute
from tests.faults import lesson
from tests.faults.browsers import DONE
from tests.faults.run import run
from tests.faults.tried import OF_CLASSES, left_in_memory, try_all_seeds

from motorcade.classroom.app import AUTHORITY, PAGES, REQUESTS, make_class_app
from motorcade.classroom.folder import ClassFolder
from motorcade.classroom.running import ClassServerSettings


@cache
def asked_in_lesson(seed):
    return run("lesson", seed).asked


@pytest.mark.parametrize("kind", OF_CLASSES)
def test_all_promises_hold_whatever_goes_wrong(tried, kind):
    tried(kind)
    try_all_seeds(kind)


@pytest.mark.parametrize("kind", OF_CLASSES)
def test_a_seed_gives_the_same_run_to_the_byte(tried, kind):
    digests = tried(kind).digests
    assert run(kind, 7).digest == digests[7] != digests[8]


@pytest.mark.parametrize("kind", OF_CLASSES)
def test_a_run_leaves_nothing_in_memory(kind):
    assert left_in_memory(kind) == []


def test_all_requests_of_a_class_are_sent_by_who_may_and_by_who_must_not(tried):
    asked, more = set(tried("lesson").asked), iter(range(100, 200))
    # A change of the code changes what a seed does, and rare requests may be in none of the first seeds.
    while any((missing := _never_sent(asked)).values()):
        seed = next(more, None)
        assert seed is not None, missing
        asked |= asked_in_lesson(seed)


def test_all_routes_of_a_class_are_asked_by_who_may_and_by_who_must_not(tried, tmp_path):
    settings = ClassServerSettings(library=tmp_path, page=tmp_path, port=7710)
    app = make_class_app(settings, ClassFolder(tmp_path))._app
    routes = {route.path for route in app.routes if isinstance(route, Route | WebSocketRoute)}
    # What is behind these a table has: it is compared with the requests below.
    routes -= {"/api/class/{name:path}", "/api/teacher/{name:path}", "/api/{name:path}"}
    # Pages are for everybody. Of cars without a camera there is no picture.
    routes -= {"/", "/drive", *PAGES, AUTHORITY}
    asked, more = set(tried("lesson").asked), iter(range(100, 200))
    refused = {"class-session-needed", "teacher-session-needed"}
    while missing := [
        (route, wanted)
        for route in routes
        for wanted in ({DONE, "no-camera-here"}, refused)
        if not wanted & {outcome for path, outcome in asked if path == route}
    ]:
        seed = next(more, None)
        assert seed is not None, missing
        asked |= asked_in_lesson(seed)


def _never_sent(asked):
    """The requests that nobody has sent who may, that no stranger has sent, or nobody else."""
    outcomes = {name: {outcome for request, outcome in asked if request == name} for name in lesson.TABLE}
    refused = {"class-session-needed", "teacher-session-needed"}
    guarded = [name for name in lesson.TABLE if name not in REQUESTS or not REQUESTS[name][1].is_open]
    return {
        "by who may": [name for name in REQUESTS if DONE not in outcomes[name]],
        "by a stranger": [name for name in guarded if not outcomes[name] & refused],
        "by others": [name for name in guarded if not outcomes[name] - refused],
    }
