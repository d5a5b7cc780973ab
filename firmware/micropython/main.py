"""What the board does when it is switched on: it is a car."""

from motorcade.boards.on_chip.power_on import main

main()
