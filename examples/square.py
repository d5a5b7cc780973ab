"""A leader without followers drives a square again and again."""

from motorcade import Program, forward, left, show

# A left turn at speed 1 takes 3 s for 90 degrees (30 degrees a second).
program = Program(leader=[forward(3), left(3, speed=1)])

if __name__ == "__main__":
    show(program, followers=0, seconds=24, picture="square.png")
