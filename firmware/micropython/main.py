"""Run the car when the board is switched on."""

from motorcade.boards.on_chip.power_on import main

main()
