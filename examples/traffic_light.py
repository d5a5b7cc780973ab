"""A leader stands still and shows a traffic light: LED 0 is red, LED 1 amber, LED 2 green."""

from motorcade import Program, led, repeat, show, wait

program = Program(leader=[led(0, 5), led(1, 1), led(2, 5), repeat(2, led(1, 1), wait(1))])

if __name__ == "__main__":
    show(program, followers=0, seconds=30)
