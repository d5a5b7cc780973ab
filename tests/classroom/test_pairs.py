"""One project, two windows: a pupil programs the leader, another one the followers."""

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from motorcade.classroom.folder import ClassFolder
from motorcade.classroom.pairs import AWAY_S, Pairs
from motorcade.errors import MotorcadeError
from support.class_page import PROJECT, class_room
from support.classrooms import refused, with_pupils

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


def write(pupil, window, number, base):
    return pupil.ask("class/pair/write", window=window, project=marked(window, number), base=base)


def test_each_stores_the_own_window_alone_and_reads_both(two):
    _, mia, bo, _ = two
    assert view(bo)["owners"] == {"leader": mia.id, "followers": bo.id}
    assert (write(mia, "leader", 1, 1), write(bo, "followers", 1, 1)) == (2, 2)
    assert write(mia, "followers", 9, 2) == write(bo, "leader", 9, 2) == "window-of-another"
    assert write(mia, "leader", 9, 1) == "saved-elsewhere", "by another page of hers"
    for pupil in (mia, bo):
        assert (mark(pupil, "leader"), mark(pupil, "followers")) == ("leader 1", "followers 1")
        assert view(pupil)["versions"] == {"leader": 2, "followers": 2}


def test_windows_are_swapped_when_both_want_it_and_how_one_plays_is_told_to_the_other(two):
    _, mia, bo, _ = two
    assert mia.ask("class/pair/conduct", playing=True, speed=2, seed=7, t_ms=400) == {}
    played = {"number": 1, "by": mia.id, "playing": True, "speed": 2, "seed": 7, "t_ms": 400}
    assert view(bo)["conducted"] == played
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
    assert eve.ask("class/pair/join") == {}
    assert view(mia)["owners"] == {"leader": mia.id, "followers": eve.id}
    # The project of the pair stays.
    assert mark(eve, "leader") == "leader 0"


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


class AnyOrder(RuleBasedStateMachine):
    """Three pupils do anything in any order: no window has two owners, nor one who isn't in the pair."""

    def __init__(self):
        super().__init__()
        self.room = with_pupils("Mia", "Bo", "Eve")
        self.pairs = Pairs(self.room)
        self.now_s = 0.0

    who = st.sampled_from(["01", "02", "03"])
    window = st.sampled_from(["leader", "followers"])

    def attempt(self, act, *arguments):
        before = self.owners()
        try:
            act(*arguments)
        except MotorcadeError:
            assert self.owners() == before

    def owners(self):
        return [dict(pair.owners) for pair in self.room.record.pairs]

    @rule(who=who, to=who)
    def begin(self, who, to):
        self.attempt(self.pairs.begin, who, to, "Parade")

    @rule(who=who)
    def join(self, who):
        self.attempt(self.pairs.join, who)

    @rule(who=who, window=window, wants=st.booleans())
    def take(self, who, window, wants):
        pair = self.pairs.of(who)
        before = pair and pair.owners[window]
        self.attempt(self.pairs.take, who, window, wants, self.now_s)
        if before not in (None, who) and self.pairs.of(who) and self.now_s < AWAY_S:
            assert pair.owners[window] == before

    @rule(who=who, wants=st.booleans())
    def swap(self, who, wants):
        self.attempt(self.pairs.swap, who, wants)

    @rule(who=who)
    def leave(self, who):
        self.pairs.leave(who)

    @rule()
    def wait(self):
        self.now_s += AWAY_S / 2
        self.pairs.advance(self.now_s)

    @invariant()
    def owners_are_members(self):
        members = [each for pair in self.room.record.pairs for each in pair.members]
        assert len(members) == len(set(members))
        for pair in self.room.record.pairs:
            assert 0 < len(pair.joined) <= len(pair.members) <= 2
            assert {*pair.owners.values()} <= {None, *pair.joined}
        for each in ("01", "02", "03"):
            self.pairs.view(each)


TestAnyOrder = AnyOrder.TestCase
TestAnyOrder.settings = settings(max_examples=40, stateful_step_count=25, deadline=None)


def test_who_was_asked_may_refuse():
    room = with_pupils("Mia", "Bo")
    pairs = Pairs(room)
    pairs.begin("01", "02", "Parade")
    assert pairs.view("02").joined is False
    refused("not-in-a-pair", pairs.joined, "02")
    pairs.leave("02")
    assert pairs.view("01").partner is None
    assert pairs.view("01").owners == {"leader": "01", "followers": "01"}
