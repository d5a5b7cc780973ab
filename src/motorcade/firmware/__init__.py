"""What is put on a board that runs MicroPython, and how it gets there."""
