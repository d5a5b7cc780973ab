"""One project, two windows: a pupil programs the leader, another one the followers."""

from functools import partial

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motorcade.classroom.folder import ClassFolder
from motorcade.classroom.pairs import AWAY_S, Pairs
from motorcade.config.files import SaveError
from motorcade.errors import MotorcadeError
from motorcade.server.studio.library import OWNERS
from support.class_page import PROJECT, class_room
from support.classrooms import with_pupils

BOTH = {"leader": {"blocks": {"mark": "leader 0"}}, "followers": {"blocks": {"mark": "followers 0"}}}


def marked(window, number):
    return PROJECT | BOTH | {window: {"blocks": {"mark": f"{window} {number}"}}}


def mark(pupil, window):
    return pupil.ask("class/pair/read", window=window)["project"][window]["blocks"]["mark"]


@pytest.fixture
def two(tmp_path):
    """Mia and Bo, who work together."""
    now = [100.0]
    with class_room(tmp_path, clock=lambda: now[0]) as room:
        mia, bo = room.join("Mia"), room.join("Bo")
        assert mia.ask("class/pair/begin", to=bo.id, name="Parade", project=PROJECT | BOTH) == {}
        assert bo.ask("class/pair/join") == {}
        yield room, mia, bo, now


def view(pupil):
    with pupil.open("class/stream") as page:
        return page.until("pupil")["pair"]


def write(pupil, window, number, base, pair="1"):
    return pupil.ask("class/pair/write", pair=pair, window=window, project=marked(window, number), base=base)


def test_each_stores_the_own_window_alone_and_reads_both(two):
    _, mia, bo, _ = two
    assert view(bo)["owners"] == {"leader": mia.id, "followers": bo.id}
    assert (write(mia, "leader", 1, 1), write(bo, "followers", 1, 1)) == (2, 2)
    assert write(mia, "followers", 9, 2) == write(bo, "leader", 9, 2) == "window-of-another"
    assert write(mia, "leader", 9, 1) == "saved-elsewhere", "by another page of hers"
    for pupil in (mia, bo):
        assert (mark(pupil, "leader"), mark(pupil, "followers")) == ("leader 1", "followers 1")
        assert view(pupil)["versions"] == {"leader": 2, "followers": 2}


def test_a_page_is_shown_a_pair_when_both_windows_can_be_read(tmp_path, monkeypatch):
    shown = []

    def stored(folder, *arguments, store=ClassFolder.write_version, **named):
        shown.append(view(mia))
        return store(folder, *arguments, **named)

    with class_room(tmp_path) as room:
        mia, bo = room.join("Mia"), room.join("Bo")
        monkeypatch.setattr(ClassFolder, "write_version", stored)
        assert mia.ask("class/pair/begin", to=bo.id, name="Parade", project=PROJECT | BOTH) == {}
        assert shown == [None, None]
        assert view(mia)["versions"] == {"leader": 1, "followers": 1}


def test_both_windows_are_played_for_one_mission_also_after_the_class_began_again(tmp_path):
    chosen = {"id": "follow-me", "document": None}
    with class_room(tmp_path) as room:
        mia, bo = room.join("Mia"), room.join("Bo")
        begin = {"to": bo.id, "name": "Out", "project": PROJECT | BOTH, "mission": chosen}
        assert mia.ask("class/pair/begin", **begin) == {}
        assert bo.ask("class/pair/read", window="leader") == "not-in-a-pair", "who has not come is told nothing"
        bo.ask("class/pair/join")
        cookies = bo.client.cookies
    with class_room(tmp_path, first_key=None, files=ClassFolder(tmp_path)) as room:
        again = room.browser()
        again.client.cookies = cookies
        assert again.ask("class/pair/read", window="leader")["mission"] == chosen
        assert again.ask("class/pair/read", window="followers")["mission"] is None


def go_on(pupil, pair, number=5):
    opened = {"pair": pair, "name": "Next", "project": marked("leader", number), "mission": {"id": "two-laps"}}
    return pupil.ask("class/pair/open", **opened)


def libraries_of_pairs(folder):
    return [each.name[:6] for each in (folder / OWNERS).glob("pair-*")]


def test_whoever_opens_the_next_mission_takes_the_other_one_along_also_through_a_new_begin(tmp_path):
    with class_room(tmp_path) as room:
        mia, bo = room.join("Mia"), room.join("Bo")
        begin = {"to": bo.id, "name": "Out", "project": PROJECT | BOTH, "mission": {"id": "follow-me"}}
        assert mia.ask("class/pair/begin", **begin) == {}
        bo.ask("class/pair/join")
        mia.ask("class/pair/conduct", playing=True, speed=2, seed=7, t_ms=400)
        assert go_on(bo, "1") == {}
        assert go_on(mia, "1", 6) == "pair-went-on", "she has pressed the same at the same moment"
        assert write(mia, "leader", 7, 1) == "pair-went-on", "what she has written for the mission of before"
        now = view(mia)
        assert (now["id"], now["name"], now["conducted"]) == ("2", "Next", None)
        assert now["owners"] == {"leader": mia.id, "followers": bo.id}
        assert libraries_of_pairs(tmp_path) == ["pair-2"]
        cookies = mia.client.cookies
    with class_room(tmp_path, first_key=None, files=ClassFolder(tmp_path)) as room:
        again = room.browser()
        again.client.cookies = cookies
        read = again.ask("class/pair/read", window="leader")
        assert (read["mission"]["id"], read["version"]) == ("two-laps", 1)
        assert mark(again, "leader") == "leader 5"
        assert write(again, "leader", 8, 1, pair="2") == 2


def test_a_pair_keeps_what_it_has_where_the_next_mission_cant_be_stored(tmp_path, monkeypatch):
    shown = []

    def fills_up(folder, owner, name, *more, store=ClassFolder.write_version, **named):
        shown.append(view(mia)["id"])
        if name == "followers":
            raise SaveError("cant-save", reason="full")
        return store(folder, owner, name, *more, **named)

    with class_room(tmp_path) as room:
        mia, bo = room.join("Mia"), room.join("Bo")
        assert mia.ask("class/pair/begin", to=bo.id, name="Parade", project=PROJECT | BOTH) == {}
        with monkeypatch.context() as patched:
            patched.setattr(ClassFolder, "write_version", fills_up)
            assert go_on(mia, "1") == "cant-save"
        assert set(shown) == {"1"}, "until all is stored, pages show what they have"
        assert mark(mia, "leader") == "leader 0"
        assert go_on(mia, "1") == {}
        assert libraries_of_pairs(tmp_path) == ["pair-3"], "nothing stays of what could not be stored"


def test_a_page_that_comes_late_is_told_how_long_ago_the_other_one_played(two):
    _, mia, bo, now = two
    mia.ask("class/pair/conduct", playing=True, speed=2, seed=7, t_ms=400)
    now[0] += 3
    assert view(bo)["conducted"]["age_ms"] == 3000


def test_windows_are_swapped_when_both_want_it_and_how_one_plays_is_told_to_the_other(two):
    _, mia, bo, _ = two
    assert mia.ask("class/pair/conduct", playing=True, speed=2, seed=7, t_ms=400) == {}
    played = {"number": 1, "by": mia.id, "playing": True, "speed": 2, "seed": 7, "t_ms": 400, "age_ms": 0}
    assert view(bo)["conducted"] == played
    assert bo.ask("class/pair/conduct", playing=False, speed=2, seed=7, t_ms=900) == {}
    assert view(mia)["conducted"] == played | {"number": 2, "by": bo.id, "playing": False, "t_ms": 900}
    assert mia.ask("class/pair/swap", wants=True) == {}
    assert view(bo)["asks"] == mia.id
    assert mia.ask("class/pair/swap", wants=True) == {}
    assert view(bo)["owners"]["leader"] == mia.id
    assert bo.ask("class/pair/swap", wants=True) == {}
    assert view(mia)["owners"] == {"leader": bo.id, "followers": mia.id}
    assert write(mia, "leader", 1, 1) == "window-of-another"
    assert write(bo, "leader", 1, 1) == 2


def test_whoever_leaves_gives_the_window_back_and_takes_a_copy_along(two):
    _, mia, bo, _ = two
    write(bo, "followers", 1, 1)
    assert bo.ask("class/pair/leave") == "Parade"
    assert bo.ask("projects/read", name="Parade")["followers"]["blocks"]["mark"] == "followers 1"
    assert write(mia, "followers", 2, 2) == "window-is-free"
    assert mia.ask("class/pair/take", window="followers", wants=True) == {}
    assert write(mia, "followers", 2, 2) == 3
    assert write(bo, "followers", 3, 3) == "not-in-a-pair"
    assert mia.ask("class/pair/leave") == "Parade"
    assert (view(mia), view(bo)) == (None, None)


def test_a_partner_whose_tablet_sleeps_holds_the_window_up_for_a_moment_only(two):
    _, mia, bo, now = two
    with bo.open("class/stream") as page:
        page.until("pupil")
        now[0] += 10 * AWAY_S
        assert mia.ask("class/pair/take", window="followers", wants=True) == "window-of-another"
    now[0] += AWAY_S / 2
    assert mia.ask("class/pair/take", window="followers", wants=True) == "window-of-another"
    now[0] += AWAY_S / 2
    assert mia.ask("class/pair/take", window="followers", wants=True) == {}
    # The tablet wakes up, and sends what it has not sent yet.
    assert write(bo, "followers", 1, 1) == "window-of-another"
    assert mark(mia, "followers") == "followers 0"


def test_nobody_comes_into_two_pairs_and_who_is_removed_is_in_none(two):
    room, mia, bo, _ = two
    eve = room.join("Eve")
    begin = {"name": "Other", "project": PROJECT}
    assert eve.ask("class/pair/begin", to=bo.id, **begin) == "in-a-pair-already"
    assert eve.ask("class/pair/begin", to=eve.id, **begin) == "in-a-pair-already"
    assert mia.ask("class/pair/begin", to=eve.id, **begin) == "in-a-pair-already"
    assert eve.ask("class/pair/read", window="leader") == "not-in-a-pair"
    room.teacher.ask("teacher/remove", pupil=bo.id)
    assert view(mia)["owners"] == {"leader": mia.id, "followers": None}
    assert mia.ask("class/pair/begin", to=eve.id, **begin) == {}
    assert eve.ask("class/pair/leave") == "", "who was asked may refuse"
    assert (view(mia)["partner"], view(mia)["owners"]) == (None, {"leader": mia.id, "followers": None})
    assert mia.ask("class/pair/begin", to=eve.id, **begin) == {}
    assert view(eve)["joined"] is False
    assert eve.ask("class/pair/join") == {}
    assert view(mia)["owners"] == {"leader": mia.id, "followers": eve.id}
    # The project of the pair stays.
    assert mark(eve, "leader") == "leader 0"


def test_who_leaves_a_pair_late_stays_in_the_one_of_meanwhile():
    pairs = Pairs(with_pupils("Mia", "Bo"))
    before, now = pairs.add("Parade"), pairs.add("Other")
    pairs.begin("01", "02", before)
    pairs.leave("01", before.id)
    pairs.begin("01", "02", now)
    # Another tab of hers has asked for the same, and its copy is stored only now.
    pairs.leave("01", before.id)
    assert pairs.of("01") is now


def test_a_class_begun_again_has_all_windows_as_they_were_answered(tmp_path):
    with class_room(tmp_path) as room:
        mia, bo = room.join("Mia"), room.join("Bo")
        mia.ask("class/pair/begin", to=bo.id, name="Parade", project=PROJECT | BOTH)
        bo.ask("class/pair/join")
        write(mia, "leader", 1, 1)
        cookies = mia.client.cookies
    with class_room(tmp_path, first_key=None, files=ClassFolder(tmp_path)) as room:
        again = room.browser()
        again.client.cookies = cookies
        assert view(again)["versions"] == {"leader": 2, "followers": 1}
        assert mark(again, "leader") == "leader 1"


ACTS = ("begin", "join", "take", "swap", "leave", "wait")
WHO, WINDOW = st.sampled_from(["01", "02", "03"]), st.sampled_from(["leader", "followers"])


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(ACTS), WHO, WHO, WINDOW, st.booleans()), max_size=25))
def test_whatever_three_pupils_do_a_window_has_one_owner_who_is_in_the_pair(acts):
    room = with_pupils("Mia", "Bo", "Eve")
    pairs, now_s = Pairs(room), 0.0
    for act, who, to, window, wants in acts:
        now_s += AWAY_S / 4 * (act == "wait")
        pair, before = pairs.of(who), [dict(each.owners) for each in room.record.pairs]
        owner = pair and pair.owners[window]
        doing = {
            "begin": lambda who=who, to=to: pairs.begin(who, to, pairs.to_ask(who, to) or pairs.add("Parade")),
            "join": partial(pairs.join, who),
            "take": partial(pairs.take, who, window, wants, now_s),
            "swap": partial(pairs.swap, who, wants),
            "leave": partial(pairs.leave, who),
            "wait": partial(pairs.advance, now_s),
        }
        try:
            doing[act]()
        except MotorcadeError:
            assert [dict(each.owners) for each in room.record.pairs] == before
        if act == "take" and owner not in (None, who) and now_s < AWAY_S:
            assert pair.owners[window] == owner
        members = [each for pair in room.record.pairs for each in pair.members]
        assert len(members) == len(set(members))
        for each in room.record.pairs:
            assert 0 < len(each.joined) <= len(each.members) <= 2
            assert {*each.owners.values()} <= {None, *each.joined}
        for each in ("01", "02", "03"):
            pairs.view(each, now_s)
