"""Pieces of mats in TOML, for tests."""

from motorcade.config.profile import built_in_profile
from motorcade.mats import Mat, parse_mat

CLASSROOM = built_in_profile("classroom")
HEAD = 'format = "motorcade-mat/1"\nname = "n"\n'
CAR = "[[car]]\nat_m = [1, 1]\n"
AREA = "corner_m = [0, 0]\nsize_m = [5, 5]\n"


def mat(body: str) -> Mat:
    return parse_mat(HEAD + body, "m", "TOML")
