"""What a run says of its cars besides their recording."""

import math

from motorcade import Program, compile_program, forward, left
from motorcade.config.profile import built_in_profile
from motorcade.mats import Pose, open_table
from motorcade.runs.running import simulate


def test_a_run_says_how_far_each_car_drove_along_its_way() -> None:
    image = compile_program(Program([forward(1, speed=3), left(1), forward(1, speed=3)], None)).image
    run = simulate(image, seconds=3, mat=open_table([Pose(0, 0), Pose(0, 5)], tick_ms=20))
    way_m = 2 * built_in_profile("classroom").speeds_mm_s[3] / 1000
    leader, follower = run.driven_m.tolist()
    assert math.isclose(leader, way_m, rel_tol=0.05)
    assert follower == 0
    end = run.world.snapshot()
    assert math.hypot(end.x_m[0], end.y_m[0]) < 0.95 * leader
