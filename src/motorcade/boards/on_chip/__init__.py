"""The parts of a car on a microcontroller, for `motorcade.boards.micropython`.

Portable. MicroPython's modules (machine, time, os, ...) are arguments, so that tests can pass simulated ones.
"""
