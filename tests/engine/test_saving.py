"""A saved world goes on with equal bits, whatever runs it; bytes that are no world are refused in a sentence."""

import copy
import hashlib
import pickle
import subprocess
import sys
from typing import Any

import pytest
from hypothesis import given, reject, settings
from hypothesis import strategies as st

from motorcade import Pose
from motorcade.car import decisions
from motorcade.engine import saving
from motorcade.engine.backend import NAMES
from motorcade.engine.world import World
from motorcade.errors import MotorcadeError
from motorcade.mats.document import document_of, mat_without_cars
from motorcade.words.flow import COUNT, IN_TURN, TELL, VOICE
from motorcade.words.formats import FLOW, STATE
from motorcade.words.image import Image, image_words
from motorcade.words.packing import words_to_bytes
from support.worlds import ROAMING, Case, CrowdedWorld, cases, crowd

FEW = settings(max_examples=max(settings().max_examples // 5, 1))
SLICE_MS = 200
BEHIND_MAGIC = len(saving.MAGIC) + 32


def resealed(data: bytes) -> bytes:
    """Bytes that somebody has changed, with the digest that belongs to them."""
    return saving.MAGIC + hashlib.sha256(data[BEHIND_MAGIC:]).digest() + data[BEHIND_MAGIC:]


@FEW
@given(cases(tick_ms=20), cases(tick_ms=20), st.data())
def test_a_saved_world_goes_on_with_equal_bits_with_any_kernels(case: Case, other: Case, data: st.DataObject) -> None:
    """Cars drive and are driven, walls have changed, and the worlds are saved at any tick."""
    for mat in (case.mat, other.mat):
        try:
            mat_without_cars(document_of(mat), "any")
        except MotorcadeError:
            # No file can hold it, so no world of a user has it.
            reject()
    world = CrowdedWorld(case.mat, case.images, case.profile, seeds=[case.seed, 7], events=True, kernels="native")
    worlds = dict.fromkeys(NAMES, world)
    for number in range(3):
        if number == 1:
            world.set_environment(other.mat)
        car, angle = data.draw(st.integers(0, world.cars - 1)), data.draw(st.integers(0, 180))
        pose = Pose(float(other.mat.starts.x_m[number]), float(other.mat.starts.y_m[number]), 0.3)
        duration_ms = 20 * data.draw(st.integers(0, 30))
        saved = world.save()
        worlds = {name: World.load(saved, kernels=name) for name in NAMES}
        assert [each.save() for each in worlds.values()] == [saved] * 3
        for each in (world, *worlds.values()):
            each.move(car, pose, world=1)
            each.drive(car, angle, number % 2, 200, world=1)
            each.say(("stop", "go")[number % 2])
            each.run(duration_ms)
        assert {each.save() for each in worlds.values()} == {world.save()}
    events = world.take_events().tolist()
    assert [each.take_events().tolist() for each in worlds.values()] == [events] * 3
    for each in (world, *worlds.values()):
        each.reset()
        each.run(SLICE_MS)
    assert {each.save() for each in worlds.values()} == {world.save()}


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (decisions.WORDS, 4),
        (decisions.LOOKS, 0),
        (decisions.TELLS, 0),
        (decisions.NEXT, 3),
        (decisions.CALLS, 5),
        (decisions.RETURNS, 3),
        (decisions.RETURNS + 3, 255),
        (decisions.TURNS, 3),
        (decisions.TOLD, 2),
        (decisions.TOLD_TURNS, 200),
    ],
)
def test_decisions_that_would_lead_a_kernel_astray_are_refused(place: int, value: int) -> None:
    """The last bytes of a world without events are those of its only leader."""
    state = STATE.encode(forward=1, motor_enable=1, motor_speed=1, motor_duration=1, avoid_enable=1, until=VOICE)
    leader = (state, FLOW.encode(op=TELL, target=IN_TURN), FLOW.encode(op=COUNT, level=1, value=1))
    image = words_to_bytes(image_words(Image(leader, (0x80280000, 0x80480000), 0, 1, 1)))
    world = CrowdedWorld(crowd(6), [image], seeds=5)
    world.run(3500)
    saved = world.save()
    assert World.load(saved).counters_of(0) == world.counters_of(0) == [3, 0, 0, 0]
    at = len(saved) - decisions.SIZE + place
    assert code_of(resealed(saved[:at] + bytes([value]) + saved[at + 1 :])) == "world-damaged"


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_a_world_saved_by_one_thread_goes_on_equally_by_several(threads: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("motorcade.engine.world._LARGE", 300)
    worlds = [CrowdedWorld(crowd(400), [ROAMING], seeds=4, events=True, threads=count) for count in (1, threads)]
    for world in worlds:
        world.run(620)
    saved = [world.save() for world in worlds]
    assert saved[0] == saved[1]
    worlds = [World.load(saved[0], threads=count) for count in (threads, 1)]
    for world in worlds:
        world.run(700)
    assert worlds[0].save() == worlds[1].save()
    assert worlds[0].take_events().tolist() == worlds[1].take_events().tolist()


def test_a_copy_and_a_pickle_are_worlds_of_their_own() -> None:
    world = CrowdedWorld(crowd(12), [ROAMING], seeds=range(3), events=True, kernels="webassembly", threads=2)
    world.run(500)
    copies = [copy.deepcopy(world), copy.copy(world), pickle.loads(pickle.dumps(world))]
    world.run(500)
    for each in copies:
        assert (each.now_ms, each.kernels, each.threads) == (500, "webassembly", 2)
        each.run(500)
        assert each.save() == world.save()


def test_a_world_goes_on_in_another_process() -> None:
    world = CrowdedWorld(crowd(12), [ROAMING], seeds=5, events=True)
    world.run(500)
    code = "import sys; from motorcade import World; w = World.load(sys.stdin.buffer.read()); w.run(500); "
    code += "sys.stdout.buffer.write(w.save())"
    done = subprocess.run([sys.executable, "-c", code], input=world.save(), stdout=subprocess.PIPE, check=True)
    world.run(500)
    assert done.stdout == world.save()


@pytest.fixture(scope="module")
def saved() -> bytes:
    world = CrowdedWorld(crowd(6), [ROAMING], seeds=5, events=True)
    world.run(500)
    return world.save()


def code_of(data: Any) -> str:
    with pytest.raises(MotorcadeError) as caught:
        World.load(data)
    assert str(caught.value)
    return caught.value.code


def test_what_is_no_whole_world_is_refused(saved: bytes) -> None:
    assert {code_of(data) for data in (b"", b"motorcade", b"\x80\x04K\x01.", "text", None, 7)} == {"not-a-world"}
    assert {code_of(saved[:end]) for end in range(len(saving.MAGIC), len(saved), 97)} == {"world-damaged"}
    changed = [saved[:at] + bytes([saved[at] ^ 1]) + saved[at + 1 :] for at in range(len(saving.MAGIC), len(saved), 97)]
    assert {code_of(data) for data in (*changed, saved + b"\0")} == {"world-damaged"}


def test_a_world_of_another_version_is_refused(saved: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    assert code_of(saved.replace(b"motorcade-world/1", b"motorcade-world/2", 1)) == "world-of-another-version"
    monkeypatch.setattr(saving, "engine_version", lambda: "9.9 other")
    assert code_of(saved) == "world-of-another-version"


@pytest.mark.parametrize(
    ("row", "value"),
    [
        ("x", 2_147_483_647),
        ("displacement_y", 1 << 30),
        ("heard_from", 6),
        ("state", 200),
        ("slot", 200),
        ("started_ms", 1 << 29),
        ("slot_started_ms", 1 << 29),
        ("interval", 1),
    ],
)
def test_numbers_that_would_lead_a_kernel_astray_are_refused(saved: bytes, row: str, value: int) -> None:
    """Also where the digest is right: car 0 leads."""
    rows = {"state": 8, "slot": 9, "started_ms": 2, "slot_started_ms": 10, "interval": 15} | saving._ROW
    world = World.load(saved)
    behind = decisions.SIZE + 2 * 6 + 4 * 6 * (saving._ROWS - rows[row]) + len(world.untaken_rows(0))
    at = len(saved) - behind
    data = saved[:at] + value.to_bytes(4, "little") + saved[at + 4 :]
    assert code_of(resealed(data)) == "world-damaged"
