"""The RP2040's PIO program that sends a frame: one 32-bit word in, marks and spaces out.

Portable. `rp2.asm_pio` gives its function the names of instructions and registers, which linters and the type checker
don't know.
"""
# mypy: ignore-errors

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from typing import Any

# The program's steps in a cycle of the carrier, and those that a unit takes besides its cycles.
CYCLE_STEPS = 8
UNIT_OVERHEAD_STEPS = 2


def assemble(rp2: "Any") -> "Any":
    """Return the program for rp2.StateMachine. Its first word is a unit's number of carrier cycles less one."""

    @rp2.asm_pio(set_init=rp2.PIO.OUT_LOW, out_shiftdir=rp2.PIO.SHIFT_LEFT)
    def program() -> None:
        pull(block)
        mov(isr, osr)  # the unit stays here

        wrap_target()
        pull(block)  # the frame

        set(y, 15)  # header: a mark of 16 units
        label("header_mark")
        mov(x, isr)
        label("header_mark_cycle")
        set(pins, 1)[2]
        set(pins, 0)[3]
        jmp(x_dec, "header_mark_cycle")
        jmp(y_dec, "header_mark")

        set(y, 7)  # and a space of 8
        label("header_space")
        mov(x, isr)
        label("header_space_cycle")
        jmp(x_dec, "header_space_cycle")[7]
        jmp(y_dec, "header_space")

        label("bit")
        mov(x, isr)
        label("mark_cycle")
        set(pins, 1)[2]
        set(pins, 0)[3]
        jmp(x_dec, "mark_cycle")
        out(y, 1)
        jmp(not_y, "space")  # a zero: a space of 1 unit
        set(y, 2)  # a one: of 3
        label("space")
        mov(x, isr)
        label("space_cycle")
        jmp(x_dec, "space_cycle")[7]
        jmp(y_dec, "space")
        jmp(not_osre, "bit")

        mov(x, isr)  # the mark that ends the frame
        label("end_cycle")
        set(pins, 1)[2]
        set(pins, 0)[3]
        jmp(x_dec, "end_cycle")
        wrap()

    return program
