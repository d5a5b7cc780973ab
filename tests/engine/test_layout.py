"""What a world is prepared from needs no NumPy, which a browser's Python doesn't have."""

import json
import subprocess
import sys

from motorcade import World
from motorcade.config.profile import built_in_profile
from motorcade.engine import layout
from motorcade.mats import parse_mat

MAT = """
format = "motorcade-mat/1"
name = "a hall"
tick_ms = 5
size_m = [12, 9]
edge = "wall"
crowd = [{cars = 60, leaders = 3, placement = "random", seed = 4}]
wall = [{from_m = [1, 1], to_m = [3, 2]}]
disc = [{centre_m = [6, 4], radius_m = 0.5}]
person = [{path = [[0, 1, 1], [5, 8, 8]], repeats = true}]
voice = [{at_s = 2, word = "stop", centre_m = [3, 3], radius_m = 2}]
"""
CODE = f"""
import json, sys
for name in ("numba", "numpy", "wasmtime"):
    sys.modules[name] = None
from motorcade.config.profile import built_in_profile
from motorcade.engine import layout
from motorcade.mats import parse_mat
mat, images = parse_mat({MAT!r}, "mat", "TOML"), [bytes(4), bytes.fromhex("01000000 40280000")]
prepared = (
    layout.rules_of(mat, built_in_profile("classroom"), images), layout.people_of(mat, 2), layout.voices_of(mat),
    layout.standing_of(mat, 2),
)
held = {{}}
for each in prepared:
    for name, value in each._asdict().items():
        is_buffer = isinstance(value, layout.Buffer)
        held[name] = [value.dtype, value.shape, value.items.tolist()] if is_buffer else value
print(json.dumps([held, layout.outlines_of(mat)]))
"""


def test_a_world_is_prepared_without_numpy_and_begins_as_prepared() -> None:
    ran = subprocess.run([sys.executable, "-c", CODE], check=True, capture_output=True, encoding="utf-8")
    held, outlines = json.loads(ran.stdout)
    mat = parse_mat(MAT, "mat", "TOML")
    world = World(mat, [bytes(4), bytes.fromhex("01000000 40280000")])
    for name in ("x", "y", "heading", "number", "program"):
        assert held[name][2] == getattr(world.state, name).tolist()
    assert (len(held["x"][2]), sum(program > 0 for program in held["program"][2])) == (60, 3)
    assert sorted(set(held["program"][2])) == [0, 1, 2]
    walls, discs = layout.outlines_of(mat)
    assert outlines == [[list(wall) for wall in walls], [list(disc) for disc in discs]]
    assert held["images"] == ["uint32", [2, 2], [0, 0, 0x01000000, 0x40280000]]
    assert held["now_x"][:2] == ["float64", [2, 1]]
    assert held["levels"][2] == list(layout.levels_of(built_in_profile("classroom")))
