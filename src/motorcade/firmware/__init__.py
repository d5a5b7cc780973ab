"""Install a car's program on a board that runs MicroPython."""
