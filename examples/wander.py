"""A herd: all cars wander at random and avoid each other."""

from motorcade import Program, obstacle, show, wander

program = Program(
    leader=[wander(3, speed=1, unless=obstacle(2))],
    followers=[wander(3, speed=2, unless=obstacle(2))],
)

if __name__ == "__main__":
    show(program, followers=6, seconds=30, seed=7, picture="wander.png")
