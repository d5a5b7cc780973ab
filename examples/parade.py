"""The followers drive the same figure as the leader, each from its own place."""

from motorcade import Program, forward, led, left, show, together

program = Program(
    leader=[together(forward(4), led(0, 1)), left(2, speed=1)],
    followers=[together(forward(4), led(1, 1)), together(left(2, speed=1), led(2, 2))],
)

if __name__ == "__main__":
    show(program, followers=8, seconds=30, picture="parade.png")
