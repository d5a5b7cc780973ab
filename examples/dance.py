"""The leader turns in the middle of a star; the dancers drive out, turn round and come back."""

import math

from motorcade import Pose, Program, forward, led, left, open_table, right, show, together

DANCERS = 8
RADIUS_M = 0.4

program = Program(
    leader=[together(left(2, speed=3), led(0, 2)), together(right(2, speed=3), led(3, 2))],
    followers=[
        together(forward(2), led(0, 1)),
        together(left(2, speed=3), led(1, 2)),
        together(forward(2), led(2, 1)),
        together(left(2, speed=3), led(3, 2)),
    ],
)


def star() -> list[Pose]:
    """Return the places of the leader in the middle and of the dancers around it, each facing outwards."""
    poses = [Pose(0, 0)]
    for number in range(DANCERS):
        angle = math.tau * number / DANCERS
        poses.append(Pose(RADIUS_M * math.cos(angle), RADIUS_M * math.sin(angle), angle))
    return poses


if __name__ == "__main__":
    show(program, seconds=30, mat=open_table(star()), picture="dance.png")
