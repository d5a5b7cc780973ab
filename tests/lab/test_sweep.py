"""Sweeps: reading and refusing specifications, parameter points, the plan, and the rows of the table."""

import dataclasses
import io
import math
import sys
import time
from random import Random
from types import SimpleNamespace

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import settings

from motorcade import Program, forward, led
from motorcade.config.profile import built_in_profile
from motorcade.engine.world import World
from motorcade.errors import MotorcadeError
from motorcade.lab import plan as planning
from motorcade.lab.plan import Plan
from motorcade.lab.run import Store, on_this_computer, run_sweep
from motorcade.lab.spec import parse_sweep
from motorcade.lab.task import run_task
from motorcade.mats import Pose, Starts, open_table
from motorcade.program.compiler import compile_program
from motorcade.program.model import Followers
from support.waiting import DEADLINE_S

HEAD = 'format = "motorcade-sweep/1"\nprograms = ["a"]\n'
CLASSROOM = built_in_profile("classroom")
IMAGE = compile_program(Program(leader=[forward(3)], followers=Followers([led(0, 1), led(1, 1)]))).image
PASSED_ON = compile_program(Program(leader=[forward(3)], followers=Followers([led(0, 1)], forward=True))).image


def test_without_mats_the_only_program_drives_on_its_own():
    text = f"{HEAD}seconds = 1\n"
    assert parse_sweep(text, "it.toml").mats == ("empty",)
    assert parse_sweep(text, "it.toml", lambda program: True).mats == ("a",)
    named = text.replace('["a"]', '["a"]\nmats = ["empty"]')
    assert parse_sweep(named, "it.toml", lambda program: True).mats == ("empty",)
    with pytest.raises(MotorcadeError, match="the project b has a mat of its own, and there are several programs"):
        parse_sweep(text.replace('["a"]', '["a", "b"]'), "it.toml", lambda program: program == "b")


def spec(text="", seconds="1"):
    return parse_sweep(f"{HEAD}seconds = {seconds}\n{text}", "it.toml")


def plan_of(text="", seconds="1", mats=(None,), image=IMAGE):
    return Plan(spec(text, seconds), [(image, CLASSROOM)], mats, "1")


def rows_of(plan):
    tables = [pq.read_table(io.BytesIO(run_task(plan.task(index)))) for index in range(plan.tasks)]
    return [row for table in tables for row in table.to_pylist()]


# Specifications


def test_a_grid_has_every_combination_and_its_last_parameter_varies_fastest():
    points = spec('[grid]\ncars = [1, 2]\nphysics.collisions = [true, false]\n"profile.speeds_mm_s[2]" = [150]').points
    assert [points.at(index) for index in range(points.count)] == [
        {"cars": cars, "physics.collisions": collisions, "profile.speeds_mm_s[2]": 150}
        for cars in (1, 2)
        for collisions in (True, False)
    ]


def test_a_name_may_have_quotes_or_not():
    assert spec("[grid]\nphysics.wheel_noise = [0]") == spec('[grid]\n"physics.wheel_noise" = [0]')


@pytest.mark.parametrize(
    ("text", "seeds"),
    [
        ("", [0]),
        ("seeds = 3", [0, 1, 2]),
        ("seeds = {first = 5, count = 2}", [5, 6]),
        ("seeds = {first = 4294967294, count = 2}", [4294967294, 4294967295]),
        ("seeds = [9, 4]", [9, 4]),
    ],
)
def test_seeds_are_counted_or_listed(text, seeds):
    assert list(spec(text).seeds) == seeds


def drawn(ranges, count=400):
    points = spec(f"[sample]\ncount = {count}\nseed = 3\n{ranges}").points
    return [points.at(index) for index in range(count)]


def test_draws_fill_their_range_and_whole_numbers_reach_both_ends():
    points = drawn("cars = {from = 2, to = 4}\nphysics.bit_error_rate = {from = 1e-4, to = 0.01, log = true}")
    assert {point["cars"] for point in points} == {2, 3, 4}
    rates = sorted(point["physics.bit_error_rate"] for point in points)
    assert 1e-4 <= rates[0] < 1.1e-4
    assert 0.009 < rates[-1] <= 0.01
    # Even in the logarithm: the middle one is near the geometric mean.
    assert rates[200] == pytest.approx(1e-3, rel=0.3)


def test_a_draw_depends_on_no_other_draw():
    first = drawn("cars = {from = 1, to = 1000}", count=5)
    more = drawn("tick_ms = {from = 1, to = 2}\ncars = {from = 1, to = 1000}", count=9)
    assert [point["cars"] for point in more[:5]] == [point["cars"] for point in first]
    assert len({point["cars"] for point in more}) > 5
    both = drawn("physics.bit_error_rate = {from = 0, to = 0.5}\nphysics.wheel_noise = {from = 0, to = 0.5}", count=5)
    assert all(len(set(point.values())) == 2 for point in both)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("more = 1", "more is not known"),
        ("mats = []", "mats is []"),
        ("mats = ['a.toml', 'a.toml']", 'mats[1] is "a.toml", which is in the list already'),
        ("seeds = 0", "seeds is 0"),
        ("seeds = {count = 3, step = 2}", "seeds.step is not known"),
        ("seeds = {first = 4294967294, count = 3}", "seeds.count is 3; allowed: a whole number from 1 to 2"),
        ("seeds = [1, 2, 1]", "seeds[2] is 1, which is in the list already"),
        ("[grid]\nphysics.bit_error_rat = [0]", "did you mean physics.bit_error_rate?"),
        (
            "[grid]\nphysics.bit_error_rate = [0, nan]",
            "grid.physics.bit_error_rate[1] is nan; allowed: a number from 0 to 0.5",
        ),
        ("[grid]\nphysics.bit_error_rate = [0.6]", "grid.physics.bit_error_rate[0] is 0.6"),
        (
            "[grid]\nphysics.capture_ratio = ['never', 1]",
            'grid.physics.capture_ratio[1] is 1; allowed: a number above 1, up to 1000000, or "never"',
        ),
        ("[grid]\nphysics.collisions = [1]", "grid.physics.collisions[0] is 1; allowed: true or false"),
        ("[grid]\ncars = [1, 2.5]", "grid.cars[1] is 2.5; allowed: a whole number from 0 to 1000000"),
        ("[grid]\ncars = [true]", "grid.cars[0] is true"),
        ("[grid]\ncars = 5", "grid.cars is 5; allowed: a list"),
        ("[grid]\ncars = [5, 6, 5]", "grid.cars[2] is 5, which is in the list already"),
        ("[grid]\ntick_ms = [41]", "grid.tick_ms[0] is 41"),
        ("[grid]\nprofile.speeds_mm_s[2] = [150]", "A name with brackets needs quotes"),
        ("mats = ['empty', 'a.toml']\n[grid]\ncars = [5]", "mats[1], 'a.toml', has its own cars"),
        ("seeds = 1000000\n[grid]\ncars = [1,2,3,4,5,6,7,8,9,10,11]", "these are 11,000,000 runs"),
        ("[sample]\ncount = 2\n[grid]\ncars = [5]", "[grid] and [sample] exclude each other"),
        ("[sample]\ncars = {from = 1, to = 2}", "sample.count is missing"),
        ("[sample]\ncount = 2", "names no parameter"),
        ("[sample]\ncount = 2\ncars = [1, 2]", "sample.cars is [1, 2]; allowed: a range such as {from = 1, to = 50}"),
        ("[sample]\ncount = 2\ncars = {from = 3, to = 2}", "sample.cars: from is 3 and to is 2"),
        ("[sample]\ncount = 2\ncars = {from = 2, to = 2}", "sample.cars: from is 2 and to is 2"),
        ("[sample]\ncount = 2\ncars = {from = 0, to = 2, log = true}", "sample.cars.from is 0; with log"),
        ("[sample]\ncount = 2\nphysics.collisions = {from = 0, to = 1}", "true or false and has no range"),
    ],
)
def test_a_fault_in_a_specification_is_refused_with_its_place(text, says):
    with pytest.raises(MotorcadeError) as refused:
        spec(text)
    assert says in str(refused.value)
    assert str(refused.value).startswith("it.toml")


@pytest.mark.parametrize("seconds", ["nan", "inf", "0", "-1", "0.00001", "1e9", "true", "'1'"])
def test_seconds_are_a_duration(seconds):
    with pytest.raises(MotorcadeError, match="seconds is"):
        spec(seconds=seconds)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[grid]\ntick_ms = [1, 3]", "tick_ms = 3: 1 s are no whole number of ticks"),
        ('[grid]\n"profile.speeds_mm_s[2]" = [150, 50]', "speeds_mm_s[2] = 50: profile classroom: speeds_mm_s is"),
        ("[grid]\nprofile.infrared.relay_period_ms = [50]", "relay_period_ms is 50"),
        ("[grid]\nprofile.body.diameter_mm = [150, 300]", "diameter_mm = 300: mat open table: car"),
        ("[grid]\ntick_ms = [1, 40]\nprofile.body.diameter_mm = [40]", "tick_ms = 40, profile.body.diameter_mm = 40: "),
    ],
)
def test_values_that_do_not_fit_each_other_are_refused_before_anything_runs(text, says):
    with pytest.raises(MotorcadeError) as refused:
        plan_of(text)
    assert says in str(refused.value)
    assert "a, the empty table" in str(refused.value)


# From points to runs


def test_parameters_reach_the_world():
    names = 'tick_ms = [5]\nphysics.wheel_noise = [0.25]\nphysics.capture_ratio = ["never"]\n'
    plan = plan_of(f'[grid]\ncars = [3]\n{names}profile.infrared.range_mm = [400]\n"profile.dwell_ms[7]" = [9000]')
    (batch,) = plan.task(0).batches
    assert len(batch.mat.starts) == 4
    assert batch.mat.starts.leads.tolist() == [True, False, False, False]
    physics = dataclasses.replace(open_table([Pose(0, 0)]).physics, wheel_noise=0.25, capture_ratio=None)
    assert (batch.mat.tick_ms, batch.mat.physics) == (5, physics)
    infrared = dataclasses.replace(CLASSROOM.infrared, range_mm=400)
    expected = dataclasses.replace(CLASSROOM, infrared=infrared, dwell_ms=(*CLASSROOM.dwell_ms[:7], 9000))
    assert batch.profile == expected


def test_a_run_equals_that_of_a_single_world_and_is_measured_as_documented():
    grid = "seeds = [4, 7]\n[grid]\ncars = [6]\nphysics.bit_error_rate = [0.01]\nphysics.wheel_noise = [0.2]"
    plan = plan_of(grid, seconds="1.5", image=PASSED_ON)
    rows, (batch,) = rows_of(plan), plan.task(0).batches
    assert [row["seed"] for row in rows] == [4, 7]
    for row in rows:
        world = World(batch.mat, [PASSED_ON], batch.profile, seeds=row["seed"], threads=1)
        start = world.snapshot()
        world.run(1500)
        end, counts = world.snapshot(), {name: int(value[0]) for name, value in world.counts().items()}
        assert {name: row[name] for name in counts} == counts
        cars = [SimpleNamespace(x=x, y=y, at=at) for x, y, at in zip(end.x_m, end.y_m, end.heading, strict=True)]
        assert all(counts[name] for name in ("lost_collision", "lost_sending", "lost_parity"))
        lost = sum(counts[name] for name in counts if name.startswith("lost_")) + counts["deaf"]
        assert row["lost_share"] == pytest.approx(lost / (lost + counts["heard"]))
        distances = [math.dist((car.x, car.y), (cars[0].x, cars[0].y)) for car in cars[1:]]
        assert row["leader_distance_m"] == pytest.approx(sum(distances) / 6)
        x, y = (sum(getattr(car, axis) for car in cars) / 7 for axis in "xy")
        assert row["spread_m"] == pytest.approx(math.sqrt(sum((c.x - x) ** 2 + (c.y - y) ** 2 for c in cars) / 7))
        east, north = sum(math.cos(car.at) for car in cars), sum(math.sin(car.at) for car in cars)
        assert row["alignment"] == pytest.approx(math.hypot(east, north) / 7)
        places = zip(start.x_m, start.y_m, end.x_m, end.y_m, strict=True)
        moved = [math.dist((x0, y0), (x1, y1)) for x0, y0, x1, y1 in places]
        assert row["moved_m"] == pytest.approx(sum(moved) / 7)
    assert rows[0]["spread_m"] != rows[1]["spread_m"]


def informed(ms, range_mm=1000, **given):
    grid = f"[grid]\ncars = [2]\nprofile.infrared.range_mm = [{range_mm}]"
    (row,) = rows_of(plan_of(grid, seconds=str(ms / 1000), **given))
    return row["informed_share"]


def test_the_informed_hold_the_word_that_the_leader_sent_last():
    # Two words, a second each. A frame is over within 91 ms, and a follower then holds its word.
    assert informed(1) is None
    assert informed(300) == 1
    assert informed(1000) == 1
    assert informed(1300) == 1
    # Out of range nobody holds a word, though the leader has sent some.
    assert informed(300, range_mm=100) == 0
    assert informed(300, image=compile_program(Program(leader=[forward(1)])).image) is None


def test_the_distance_is_to_the_nearest_leader_and_empty_without_leaders():
    poses = [Pose(0, 1), Pose(3, 1), Pose(0.5, 1), Pose(2, 1)]
    still = compile_program(Program(leader=[led(0, 1)])).image
    mat = dataclasses.replace(open_table(poses), starts=Starts.of(poses, [True, True, False, False]))
    (row,) = rows_of(plan_of("mats = ['two.toml']", mats=[mat], image=still))
    assert row["leader_distance_m"] == pytest.approx((0.5 + 1) / 2)
    alone = dataclasses.replace(mat, starts=Starts.of(poses, [False] * 4))
    (row,) = rows_of(plan_of("mats = ['two.toml']", mats=[alone], image=still))
    assert (row["leader_distance_m"], row["informed_share"], row["lost_share"]) == (None, None, None)


def test_the_size_of_tasks_changes_no_row(monkeypatch):
    text = "seeds = 7\n[grid]\ncars = [1, 9]\nphysics.wheel_noise = [0.1, 0.2]"
    whole = plan_of(text, seconds="0.2")
    assert whole.tasks == 1
    rows = rows_of(whole)
    assert [row["run"] for row in rows] == list(range(28))
    monkeypatch.setattr(planning, "TASK_CAR_STEPS", 70_000)
    cut = plan_of(text, seconds="0.2")
    assert cut.tasks > 8
    assert sum(map(cut.task_runs, range(cut.tasks))) == 28
    assert rows_of(cut) == rows


def test_a_run_that_fails_is_named_with_its_point(monkeypatch):
    def too_large(*arguments, **options):
        raise MemoryError

    plan = plan_of("[grid]\ncars = [3]")
    monkeypatch.setattr("motorcade.engine.world.World", too_large)
    with pytest.raises(
        MotorcadeError, match="a, the empty table, cars = 3: this computer has too little memory for it"
    ):
        run_task(plan.task(0))


def test_workers_of_a_sweep_that_is_stopped_end_in_the_middle_of_a_task():
    lasts_s = (0, 3 * DEADLINE_S)
    results = on_this_computer(2, time.sleep)(SimpleNamespace(task=lasts_s.__getitem__), range(2))
    assert next(results) == (0, None)
    begun_s = time.monotonic()
    results.close()
    assert time.monotonic() < begun_s + DEADLINE_S


def test_a_worker_with_other_code_is_refused():
    with pytest.raises(MotorcadeError, match="another Motorcade than this computer"):
        run_task(dataclasses.replace(plan_of().task(0), code="of yesterday"))


# Finished tasks


def test_parts_of_another_sweep_are_refused_and_the_change_is_named(tmp_path):
    table, plan = tmp_path / "out.parquet", plan_of("seeds = 2")
    with Store(table, plan).opened():
        pass
    for changed, what in (
        (plan_of("seeds = 3"), "seeds"),
        (plan_of("seeds = 2", seconds="2"), "seconds"),
        (plan_of("seeds = 2\n[grid]\ncars = [5]"), "parameters"),
        (plan_of("seeds = 2", image=bytes(4)), "program a"),
        (plan_of("seeds = 2", mats=[open_table([Pose(0, 0)])]), "mat empty"),
        (Plan(spec("seeds = 2"), [(IMAGE, CLASSROOM)], [None], "2"), "Motorcade"),
    ):
        refused = pytest.raises(MotorcadeError, match=rf"holds another sweep \({what} has changed\)")
        with refused, Store(table, changed).opened():
            pass
        # So they aren't taken for its own where their plan is lost, either.
        assert changed.task_name(0) != plan.task_name(0)


def test_two_commands_do_not_write_the_same_table(tmp_path):
    table, plan = tmp_path / "out.parquet", plan_of()
    refused = pytest.raises(MotorcadeError, match="another `motorcade sweep` is at work")
    with Store(table, plan).opened(), refused, Store(table, plan).opened():
        pass
    with Store(table, plan).opened():
        pass


# Damaged files of a sweep


@pytest.fixture
def stopped(tmp_path):
    """A sweep that was stopped before its first task."""
    plan = plan_of("seeds = 4")
    with Store(tmp_path / "out.parquet", plan).opened():
        pass
    return plan, tmp_path / "out.parquet"


def here(plan, tasks):
    for index in tasks:
        yield index, run_task(plan.task(index))


NO_PLANS = pytest.mark.parametrize(
    "data",
    [b"", b"{", b"[]", b"7", b"\xff", b"[" * 100_000, b"9" * 5000, b'{"seconds": []}'],
    ids=["nothing", "cut off", "a list", "a number", "no text", "brackets", "digits", "other values"],
)


@NO_PLANS
def test_a_damaged_plan_beside_the_table_is_named_and_the_sweep_goes_on_without_it(stopped, data):
    plan, table = stopped
    manifest = table.with_name("out.parquet.parts") / "sweep.json"
    manifest.write_bytes(data)
    with pytest.raises(MotorcadeError) as refused:
        run_sweep(plan, table, here)
    assert refused.value.code == "sweep-file-damaged"
    assert str(manifest) in str(refused.value)
    manifest.unlink()
    assert run_sweep(plan, table, here) == plan.tasks


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX's links")
def test_the_table_that_is_being_written_is_no_link_that_somebody_has_put_there(stopped, tmp_path):
    plan, table = stopped
    precious = tmp_path / "precious"
    precious.write_text("mine")
    (table.with_name("out.parquet.parts") / "table").symlink_to(precious)
    assert run_sweep(plan, table, here)
    assert precious.read_text() == "mine"
    assert not table.is_symlink()


def test_no_damage_of_a_part_ends_in_anything_but_a_sentence(stopped):
    plan, table = stopped
    store = Store(table, plan)
    whole = run_task(plan.task(0))
    draw = Random(7)
    codes = set()
    for _ in range(settings().max_examples // 4):
        damaged = bytearray(whole)
        for _ in range(draw.randint(1, 3)):
            damaged[draw.randrange(len(damaged))] ^= draw.randrange(1, 256)
        store.keep(0, bytes(damaged))
        try:
            store.merge()
        except MotorcadeError as problem:
            codes.add(problem.code)
    # Elsewhere the file holds what nobody reads.
    assert codes == {"sweep-file-damaged"}


@pytest.mark.parametrize("part", ["something else", "a row less"])
def test_rows_of_something_else_in_place_of_a_part_are_refused(stopped, part):
    plan, table = stopped
    rows = pa.table({"run": ["a"]}) if part == "something else" else pq.read_table(io.BytesIO(run_task(plan.task(0))))
    sink = io.BytesIO()
    pq.write_table(rows.slice(1) if part == "a row less" else rows, sink)
    Store(table, plan).keep(0, sink.getvalue())
    with pytest.raises(MotorcadeError, match="is damaged"):
        run_sweep(plan, table, here)


@NO_PLANS
def test_a_table_with_a_damaged_plan_is_no_sweeps_table(tmp_path, data):
    table = tmp_path / "out.parquet"
    schema = pa.schema([("run", pa.int64())]).with_metadata({b"motorcade.sweep": data})
    pq.write_table(pa.table({"run": [1]}, schema=schema), table)
    with pytest.raises(MotorcadeError, match="is no sweep's table"):
        run_sweep(plan_of(), table, here)
