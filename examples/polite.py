"""A car waits while a person stands in its way, and drives on when the person has gone."""

from dataclasses import replace

from motorcade import Pose, Program, World, compile_program, forward, open_table, person
from motorcade.mats import Person

program = Program(leader=[forward(3, unless=person())])
# The person comes from the side, stands in front of the car from second 3 to second 6, and walks on.
passer_by = Person(((0, 2.5, 6), (3, 2.5, 0), (6, 2.5, 0), (9, 2.5, -6)))

if __name__ == "__main__":
    mat = replace(open_table([Pose(0, 0)]), people=(passer_by,))
    world = World(mat, [compile_program(program).image])
    for second in range(9):
        world.run(1000)
        car = world.snapshot()
        state = "drives" if car.wheels[0] else "waits for somebody"
        print(f"{second + 1} s: the car {state}, at {car.x_m[0]:.2f} m")
