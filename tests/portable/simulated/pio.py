"""A replacement for the module rp2: an assembler of PIO programs, and state machines that send frames and colours.

A state machine doesn't run the program: test_pio.py runs it on an emulator of the chip.
"""

from motorcade.boards.on_chip.frame_program import CYCLE_STEPS, UNIT_OVERHEAD_STEPS
from motorcade.words.infrared import frame_durations_us
from simulated.timing import time_methods

_CONSTANTS = ("pins", "x", "y", "isr", "osr", "block", "x_dec", "y_dec", "not_y", "not_osre")
_MOST_INSTRUCTIONS = 32
_LONGEST_DELAY = 31


class Instruction:
    """One line of a program; ``[n]`` after it makes it wait for n more steps."""

    def __init__(self, name, *operands):
        self.name = name
        self.operands = operands
        self.delay = 0

    def __getitem__(self, delay):
        if not 0 <= delay <= _LONGEST_DELAY:
            raise ValueError("delay too large")
        self.delay = delay
        return self


class Program:
    """The instructions, the labels, and where the program wraps."""

    def __init__(self):
        self.instructions = []
        self.labels = {}
        self.wrap_target = 0
        self.wrap = None

    def names(self):
        """Return the globals for a function that `asm_pio` decorates."""

        def adder(name):
            def add(*operands):
                self.instructions.append(Instruction(name, *operands))
                if len(self.instructions) > _MOST_INSTRUCTIONS:
                    raise ValueError("a PIO holds 32 instructions")
                return self.instructions[-1]

            return add

        def label(name):
            if name in self.labels:
                raise ValueError("duplicate label " + name)
            self.labels[name] = len(self.instructions)

        def wrap_target():
            self.wrap_target = len(self.instructions)

        def wrap():
            self.wrap = len(self.instructions) - 1

        names = {name: adder(name) for name in ("pull", "mov", "set", "jmp", "out")}
        names.update({name: name for name in _CONSTANTS})
        names.update({"label": label, "wrap_target": wrap_target, "wrap": wrap})
        return names


class Rp2:
    """The module on ``chip``."""

    class PIO:
        OUT_LOW, SHIFT_LEFT = 2, 0

    def __init__(self, chip):

        class StateMachine:
            def __init__(self, number, program, freq, set_base, out_base=None):
                if not 1908 <= freq <= 125_000_000:
                    raise ValueError("freq out of range")
                self._freq = freq
                self._pin = set_base.number
                self._free_us = 0
                self._active = False
                self._unit_steps = None
                # Only the colours' program has such a base.
                self._sends_colours = out_base is not None

            def active(self, value):
                self._active = bool(value)

            def put(self, word):
                if not self._active:
                    raise AssertionError("a state machine that isn't active takes words, but does nothing")
                if self._sends_colours:
                    chip.notify("pixels", self._pin, word)
                    return
                if self._unit_steps is None:
                    # The program counts the unit's cycles down to 0.
                    self._unit_steps = (word + 1) * CYCLE_STEPS + UNIT_OVERHEAD_STEPS
                    chip.notify("carrier", self._pin, self._freq // CYCLE_STEPS)
                    return
                # A leader's tick may be late by a little more than the gap between frames: the FIFO holds this frame.
                if chip.now_us + 10_000 < self._free_us:
                    raise AssertionError("the frame before isn't over")
                steps = frame_durations_us(word, self._unit_steps)
                durations_us = [count * 1_000_000 // self._freq for count in steps]
                self._free_us = max(self._free_us, chip.now_us) + sum(durations_us)
                chip.notify("infrared", self._pin, durations_us)

        time_methods(chip, StateMachine, "put")
        self.StateMachine = StateMachine

    def asm_pio(self, set_init, out_shiftdir, out_init=None):
        """Decorate a function: run it once, with instructions, registers and conditions as its globals."""

        def decorate(function):
            program = Program()
            space = function.__globals__
            saved = dict(space)
            space.clear()
            space.update(program.names())
            try:
                function()
            finally:
                space.clear()
                space.update(saved)
            return program

        return decorate
