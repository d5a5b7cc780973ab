"""A car that waits while a person stands in its way, and drives on when they have gone."""

from motorcade import Pose, Program, World, compile_program, forward, load_profile, pir, together

program = Program(leader=[together(forward(3), pir())])

if __name__ == "__main__":
    image = compile_program(program).image
    world = World(image, load_profile("classroom"), [Pose(0, 0)])
    for second in range(9):
        world.people = [(2.5, 0)] if 3 <= second < 6 else []
        for _ in world.run(1000):
            state = "a person is there" if world.people else "nobody is there"
            print(f"{second + 1} s: {state}, the car is at {world.poses[0].x:.2f} m")
