"""Assemble a PIO program for an emulated RP2040: the machine words of a program that simulated/pio.py has read.

Source: the RP2040's datasheet, 3.4, "Instruction Set".
"""

from simulated.pio import Instruction, Program

_OPCODES = {"jmp": 0, "out": 3, "pull": 4, "mov": 5, "set": 7}
_CONDITIONS = {"x_dec": 2, "not_y": 3, "y_dec": 4, "not_osre": 7}
_REGISTERS = {"pins": 0, "x": 1, "y": 2, "isr": 6, "osr": 7}
_PULL_BLOCK = 0b1010_0000


def words_of(program: Program) -> list[int]:
    """Return the 16-bit words of a program that begins at address 0."""
    return [
        _OPCODES[each.name] << 13 | each.delay << 8 | _operands(each, program.labels) for each in program.instructions
    ]


def _operands(instruction: Instruction, labels: dict[str, int]) -> int:
    operands = instruction.operands
    if instruction.name == "pull":
        assert operands == ("block",)
        return _PULL_BLOCK
    if instruction.name == "jmp":
        condition, label = operands
        return _CONDITIONS[condition] << 5 | labels[label]
    register, value = operands
    if instruction.name == "mov":
        return _REGISTERS[register] << 5 | _REGISTERS[value]
    # A count of 32 bits is written as 0.
    return _REGISTERS[register] << 5 | value & 31
