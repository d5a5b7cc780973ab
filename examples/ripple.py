"""A word runs down a line of cars: each car passes it on to the next one.

The leader reaches only the first follower. When the word arrives, a car lights its LED and passes the word on. The
table at the end shows when each car got the word.
"""

from motorcade import Followers, Pose, Program, led, open_table, show, wait
from motorcade.engine.events import KINDS

CARS = 9
APART_M = 0.8  # infrared reaches 1 m: the next car, but not the second next

program = Program(leader=[wait(3)], followers=Followers([led(0, 3)], forward=True))

if __name__ == "__main__":
    run = show(program, seconds=15, mat=open_table([Pose(number * APART_M, 0) for number in range(CARS)]))
    for car in range(1, CARS):
        lit_ms = run.events["t_ms"][(run.events["car"] == car) & (run.events["kind"] == KINDS.index("start"))]
        print(
            f"car {car}, {car * APART_M:.1f} m away, " + (f"lit after {lit_ms[0]} ms" if len(lit_ms) else "stayed dark")
        )
