"""A replacement for the module rp2: an assembler of PIO programs, and state machines that run them step by step.

Source: the RP2040's datasheet, chapter 3: every instruction takes one step and
its delay, `jmp(x_dec)` jumps where x was not 0 before it is counted down, and
a state machine waits in `pull(block)` until there is a word.
"""

from simulated.timing import time_methods

_CONSTANTS = ("pins", "x", "y", "isr", "osr", "block", "x_dec", "y_dec", "not_y", "not_osre")
_MASK = 0xFFFFFFFF
_MOST_INSTRUCTIONS = 32
_LONGEST_DELAY = 31
_FIFO_WORDS = 4


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
            def __init__(self, number, program, freq, set_base):
                if not 1908 <= freq <= 125_000_000:
                    raise ValueError("freq out of range")
                self._runner = Runner(program)
                self._freq = freq
                self._pin = set_base.number
                self._free_us = 0
                self._active = False
                self._unit = None
                self._known = {}

            def active(self, value):
                self._active = bool(value)

            def put(self, word):
                if not self._active:
                    raise AssertionError("a state machine that isn't active takes words, but does nothing")
                if self._unit is None:
                    self._unit = word
                    self._runner.run(word)
                    return
                # A leader's tick may be late by a little more than the gap between frames: the FIFO holds this frame.
                if chip.now_us + 10_000 < self._free_us:
                    raise AssertionError("the frame before isn't over")
                if word not in self._known:
                    self._known[word] = self._envelope_us(self._runner.run(word))
                durations_us = self._known[word]
                self._free_us = max(self._free_us, chip.now_us) + sum(durations_us)
                chip.notify("infrared", self._pin, durations_us)

            def _envelope_us(self, edges):
                """Return marks and spaces of a carrier's edges (step, level): two cycles without a rise end a mark."""
                rises = [step for step, level in edges if level]
                cycle = rises[1] - rises[0]
                chip.notify("carrier", self._pin, self._freq // cycle)
                bounds = [rises[0]]
                for place, rise in enumerate(rises[:-1]):
                    following = rises[place + 1]
                    if following - rise >= 2 * cycle:
                        bounds += [rise + cycle, following]
                bounds.append(rises[-1] + cycle)
                steps = [bounds[place + 1] - bounds[place] for place in range(len(bounds) - 1)]
                return [count * 1_000_000 // self._freq for count in steps]

        time_methods(chip, StateMachine, "put")
        self.StateMachine = StateMachine

    def asm_pio(self, set_init, out_shiftdir):
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


class Runner:
    """Run a program: the registers of a state machine."""

    def __init__(self, program):
        self._program = program
        self._at = 0
        self._x = self._y = self._isr = self._osr = 0
        self._shifted = 32
        self._level = 0

    def run(self, word):
        """Run with ``word`` until the program pulls the next one; return the pin's edges as (step, level)."""
        edges, step, words = [], 0, [word]
        program = self._program
        while True:
            instruction = program.instructions[self._at]
            name, operands = instruction.name, instruction.operands
            following = program.wrap_target if self._at == program.wrap else self._at + 1
            if name == "pull":
                if not words:
                    return edges
                self._osr, self._shifted = words.pop(), 0
            elif name == "jmp":
                if self._holds(operands[0]):
                    following = program.labels[operands[1]]
            elif name == "set" and operands[0] == "pins":
                if operands[1] != self._level:
                    self._level = operands[1]
                    edges.append((step, self._level))
            else:
                self._move(name, *operands)
            self._at = following
            step += 1 + instruction.delay

    def _move(self, name, register, value):
        if name == "out":
            bits = value
            value = self._osr >> (32 - bits)
            self._osr = self._osr << bits & _MASK
            self._shifted += bits
        elif name == "mov":
            value = {"isr": self._isr, "osr": self._osr}[value]
        elif not 0 <= value <= 31:
            raise ValueError("set takes 0 to 31")
        if register == "x":
            self._x = value
        elif register == "y":
            self._y = value
        elif register == "isr":
            self._isr = value
        else:
            raise ValueError("this simulation has no register " + register)

    def _holds(self, condition):
        if condition == "x_dec":
            before, self._x = self._x, (self._x - 1) & _MASK
            return before != 0
        if condition == "y_dec":
            before, self._y = self._y, (self._y - 1) & _MASK
            return before != 0
        if condition == "not_y":
            return self._y == 0
        return self._shifted < 32
