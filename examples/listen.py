"""Cars that stop when somebody says 'stop' and go on at 'go'."""

from motorcade import Program, World, compile_program, forward, load_profile, together, voice
from motorcade.sim.world import formation

program = Program(leader=[together(forward(3, speed=1), voice())], followers=[together(forward(3, speed=1), voice())])

if __name__ == "__main__":
    image = compile_program(program).image
    world = World(image, load_profile("classroom"), formation(2))
    for said, seconds in ((None, 2), ("stop", 3), ("go", 2)):
        if said:
            world.say(said)
        for _ in world.run(seconds * 1000):
            places = ", ".join(f"{pose.x:.2f} m" for pose in world.poses)
            print(f"{world.now_ms // 1000} s: {said or 'nothing said yet'}; the cars are at {places}")
