"""A herd: all cars wander at random and avoid each other."""

from motorcade import Program, avoid, show, together, wander

program = Program(
    leader=[together(wander(3, speed=1), avoid(2, 3))],
    followers=[together(wander(3, speed=2), avoid(2, 3))],
)

if __name__ == "__main__":
    show(program, followers=6, seconds=30, seed=7, picture="wander.png")
