"""A word that runs down a line of cars, each passing it on to the next.

The leader reaches only the first follower. When the word arrives, a car blinks
once and goes on passing it; the table at the end shows the ripple.
"""

from motorcade import Followers, Pose, Program, led, open_table, show, wait
from motorcade.engine.events import KINDS

CARS = 9
APART_M = 0.8  # infrared reaches 1 m: the next car, not the one behind it

program = Program(leader=[wait(3)], followers=Followers([led(0, 3)], forward=True))

if __name__ == "__main__":
    run = show(program, seconds=15, mat=open_table([Pose(number * APART_M, 0) for number in range(CARS)]))
    for car in range(1, CARS):
        lit_ms = run.events["t_ms"][(run.events["car"] == car) & (run.events["kind"] == KINDS.index("start"))]
        print(
            f"car {car}, {car * APART_M:.1f} m away, " + (f"lit after {lit_ms[0]} ms" if len(lit_ms) else "stayed dark")
        )
