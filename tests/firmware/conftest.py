"""MicroPython, as for the portable tests."""

from portable.conftest import micropython_installed as micropython_installed
