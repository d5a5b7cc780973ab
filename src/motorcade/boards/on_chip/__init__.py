"""The parts of a car on a microcontroller, for `motorcade.boards.micropython`.

Portable. MicroPython's modules (machine, time, os, ...) come in as arguments, so that simulated ones can stand in.
"""
