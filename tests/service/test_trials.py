"""Behind the page a program is tried with other luck, and two runs are compared: in a server and in a browser alike."""

import dataclasses

import pytest
from msgspec import structs

from motorcade import Followers, Program, compile_program, forward, led, left, right, wait
from motorcade.browser.kernels import open_worlds
from motorcade.errors import MotorcadeError
from motorcade.missions.check import check_program
from motorcade.missions.document import built_in_mission
from motorcade.missions.schema import GOALS
from motorcade.service.difference import Compare, Compared, Difference, Show
from motorcade.service.messages import MissionChoice
from motorcade.service.trials import Explain, Failure, Luck, TrialSession, Try
from motorcade.service.world_messages import SetWorld
from support.linear_instance import MockInstance
from support.pictures import Picture
from support.session_page import MOST_CARS

# Of a mat that does not say it.
TICK_MS = 1
ROW = {
    "format": "motorcade-mat/1",
    "name": "a row",
    "car": [{"at_m": [0, 0], "role": "leader"}, {"at_m": [0.8, 0]}, {"at_m": [1.6, 0]}],
}
CROWD = {
    "format": "motorcade-mat/1",
    "name": "a hall",
    "size_m": [4, 4],
    "edge": "wall",
    "crowd": [{"cars": 12, "leaders": 1, "spacing_m": 0.4}],
}


def program(*steps, rest_s=1):
    return compile_program(Program([forward(1), wait(rest_s)], Followers(steps, forward=True))).image


DANCE = program(led(1, 1), forward(1), right(1), wait(2))
SESSIONS = {
    "server": lambda: TrialSession(MOST_CARS),
    "site": lambda: TrialSession(MOST_CARS, open_worlds(MockInstance)),
}


@pytest.fixture
def session():
    """A page's trials."""
    return SESSIONS["server"]()


def answers(session, message):
    """All that a message leads to."""
    found = session.receive(message)
    while session.is_busy:
        found += session.advance()
    return found


def difference(session, one, other, until_ms=12_000):
    found = answers(session, Compare(one, other, until_ms))
    assert [each.t_ms for each in found if isinstance(each, Compared)][-1] == until_ms
    (told,) = [each for each in found if isinstance(each, Difference)]
    return told


def image_of(mission_id, **followers):
    mission = built_in_mission(mission_id)
    changed = dataclasses.replace(mission.solution.followers, **followers)
    return compile_program(dataclasses.replace(mission.solution, followers=changed), mission.profile).image


def test_the_meter_grows_run_by_run_and_tells_what_went_wrong(session):
    """In noisy air cars without long checks obey words that nobody sent."""
    order = Try(MissionChoice("noisy-air"), image_of("noisy-air", tagged=False), 24)
    told = answers(session, order)
    assert all(isinstance(each, Luck) for each in told)
    assert told[0] == Luck(0, 0, 24, [])
    last = told[-1]
    assert (last.tried, last.of) == (24, 24)
    assert last.works + len(last.failed) == 24
    assert len(last.failed) > 12
    assert not {0, 1, 2} & {*last.failed}
    for seed in last.failed[:2]:
        (failure,) = answers(session, Explain(seed))
        assert isinstance(failure, Failure)
        assert (failure.seed, len(failure.cars)) == (seed, 1)
        assert 0 < failure.t_ms <= 40_000
        assert "car" in failure.why["en"]


def test_programs_of_a_leader_that_decides_are_tried_and_compared(session):
    """Sheep that are told to stop part from those that nobody tells when the first dog meets somebody."""
    mission = built_in_mission("sheepdog")
    images = [compile_program(program, mission.profile).image for program in (mission.solution, mission.near_miss)]
    assert answers(session, Try(MissionChoice("sheepdog"), images[0], 20))[-1] == Luck(20, 20, 20, [], [1, 2, 3])
    assert answers(session, Try(MissionChoice("sheepdog"), images[1], 20))[-1].works == 0
    told = difference(session, *(SetWorld(mission.mat_document, image=image) for image in images))
    stands, drives = "E0800000", "E2800000"
    assert (told.kind, told.car) in [("word", sheep) for sheep in (1, 2, 3)]
    assert [word and word.upper() for word in told.words] == [stands, drives]
    assert 1_500 < told.t_ms < 4_000


def test_another_program_ends_what_was_tried_before(session):
    first = Try(MissionChoice("pass-it-on"), image_of("pass-it-on", forward=False), 200)
    session.receive(first)
    session.advance()
    last = answers(session, Try(MissionChoice("pass-it-on"), image_of("pass-it-on"), 20))[-1]
    assert last == Luck(20, 20, 20, [], [1, 2, 3])


@pytest.mark.parametrize("shell", SESSIONS.values(), ids=SESSIONS)
@pytest.mark.parametrize(
    ("mission_id", "part", "stars"),
    [
        ("pass-it-on", "solution", [1, 2, 3]),
        ("pass-it-on", "near_miss", []),
        # Its third star asks for runs on other seeds, which are tried when the run ends.
        ("two-words", "solution", [1, 2]),
    ],
)
def test_the_stars_on_all_seeds_of_the_mission_are_told_before_any_other_run(shell, mission_id, part, stars):
    mission = built_in_mission(mission_id)
    image = compile_program(getattr(mission, part), mission.profile).image
    begun, first, *_ = answers(shell(), Try(MissionChoice(mission_id), image, 20))
    assert (begun.stars, begun.tried) == (None, 0)
    assert (first.stars, first.tried) == (stars, 0)
    expected = check_program(mission, getattr(mission, part)).stars
    asked = {goal.star for goal in mission.goals if GOALS[goal.kind].tries_other_seeds}
    assert {*stars} == expected - asked


def test_a_large_mission_is_tried_less_often(session):
    """200 runs of it would take minutes."""
    document = dict(built_in_mission("a-hundred-cars").document, seconds=550, goal=[{"kind": "no-touch"}], seeds=[0])
    begun = session.receive(Try(MissionChoice(document=document), image_of("a-hundred-cars"), 200))
    assert begun == [Luck(0, 0, 27, [])]


@pytest.mark.parametrize(
    ("message", "code"),
    [
        (Try(MissionChoice("nowhere"), DANCE), "no-mission"),
        (Try(MissionChoice(document={"goal": []}), DANCE), "mission-not-valid"),
        (Try(MissionChoice("pass-it-on"), b"not an image"), "image-header"),
        (Compare(SetWorld(ROW), SetWorld(CROWD)), "runs-differ-in-cars"),
        (Compare(SetWorld(ROW), SetWorld({**ROW, "crowd": [{"cars": MOST_CARS}]})), "too-many-cars"),
    ],
)
def test_what_cannot_be_tried_is_told(session, message, code):
    with pytest.raises(MotorcadeError) as problem:
        session.receive(message)
    assert problem.value.code == code
    assert not session.is_busy
    assert answers(session, Explain(1)) == answers(session, Show(0)) == []


@pytest.mark.parametrize("shell", SESSIONS)
def test_two_seeds_part_where_a_car_misses_a_word_and_why_is_told(shell):
    session = SESSIONS[shell]()
    run = SetWorld(CROWD, image=DANCE)
    told = difference(session, run, structs.replace(run, seed=1))
    assert (told.kind, told.missed) == ("word", told.words.index(None))
    assert "sent at the same time" in told.cause["en"]
    assert told.exact_ms <= told.t_ms
    # It was begun in one run then, and not in the other.
    times = [[each.t_ms for each in lane] for lane in told.begun]
    assert told.t_ms in times[1 - told.missed]
    assert told.t_ms not in times[told.missed]
    if told.late_ms is not None:
        assert told.t_ms + told.late_ms in times[told.missed]
    one, other = map(Picture, session.receive(Show(told.t_ms + 100)))
    assert (one.number, other.number) == (0, 1)
    assert one.t_ms == other.t_ms
    assert [one.cars, other.cars] == [12, 12]
    assert one.moment.x_m.tolist() == pytest.approx(other.moment.x_m.tolist(), abs=0.5)


def test_two_programs_part_where_their_words_differ(session):
    other = program(led(1, 1), forward(1), left(1), wait(2))
    told = difference(session, SetWorld(ROW, image=DANCE), SetWorld(ROW, image=other))
    assert (told.kind, told.missed, told.car) == ("word", None, 1)
    assert told.words[0] != told.words[1]
    assert 2000 <= told.t_ms < 2500
    assert told.cause["en"] == "the words of the two programs differ"
    rests = program(led(1, 1), forward(1), right(1), wait(2), rest_s=2)
    leads = difference(session, SetWorld(ROW, image=DANCE), SetWorld(ROW, image=rests))
    assert (leads.car, leads.t_ms, leads.cause["en"]) == (0, 1000, "the programs differ here")


def test_runs_that_differ_in_places_alone_part_where_that_is_seen(session):
    further = {**ROW, "car": [*ROW["car"][:2], {"at_m": [1.6, 0], "heading_deg": 90}]}
    told = difference(session, SetWorld(ROW, image=DANCE), SetWorld(further, image=DANCE))
    assert (told.kind, told.car, told.cause) == ("place", 2, None)
    assert (told.exact_ms, told.exact_car) == (TICK_MS, 2)
    assert told.t_ms < 3000


def test_the_same_run_has_no_difference(session):
    told = difference(session, SetWorld(CROWD, image=DANCE), SetWorld(CROWD, image=DANCE))
    assert (told.kind, told.exact_ms, told.cause) == ("none", None, None)
