"""Mats need no NumPy: a browser has none."""

import subprocess
import sys

CODE = """
import sys
for name in ("numba", "numpy"):
    sys.modules[name] = None
from motorcade.config.profile import built_in_profile
from motorcade.mats import check_mat, parse_mat
mat = parse_mat('''
format = "motorcade-mat/1"
name = "n"
size_m = [9, 9]
edge = "wall"
[[crowd]]
cars = 100
leaders = 4
placement = "random"
[[polygon]]
corners_m = [[4, 4], [5, 4], [5, 5]]
''', "m", "TOML")
check_mat(mat, built_in_profile("classroom"))
print(len(mat.starts))
"""


def test_a_mat_is_read_and_checked_where_there_is_no_numpy() -> None:
    done = subprocess.run([sys.executable, "-c", CODE], check=True, capture_output=True, text=True)
    assert done.stdout == "100\n"
