"""Cars stop when somebody says 'stop', and continue at 'go'."""

from motorcade import Program, World, compile_program, formation, forward, heard, open_table

program = Program(leader=[forward(3, speed=1, unless=heard())], followers=[forward(3, speed=1, unless=heard())])

if __name__ == "__main__":
    world = World(open_table(formation(2)), [compile_program(program).image])
    for voice_word, seconds in ((None, 2), ("stop", 3), ("go", 2)):
        if voice_word:
            world.say(voice_word)
        for _ in range(seconds):
            world.run(1000)
            places = ", ".join(f"{x_m:.2f} m" for x_m in world.snapshot().x_m)
            print(f"{world.now_ms // 1000} s: {voice_word or 'nothing said yet'}; the cars are at {places}")
