"""The RP2040's PIO program that sends a colour to WS2812: the upper 24 bits of a word in, pulses out.

Portable. `rp2.asm_pio` gives its function the names of instructions and registers, which linters and the type checker
don't know.
"""
# mypy: ignore-errors

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from typing import Any

# A bit takes ten steps, 1.25 µs; a 0 is high for three of them, a 1 for six.
STEPS_HZ = 8_000_000


def assemble_pixels(rp2: "Any") -> "Any":
    """Return the program for rp2.StateMachine."""

    @rp2.asm_pio(set_init=rp2.PIO.OUT_LOW, out_init=rp2.PIO.OUT_LOW, out_shiftdir=rp2.PIO.SHIFT_LEFT)
    def program() -> None:
        wrap_target()
        pull(block)
        set(y, 23)
        label("bit")
        out(x, 1)
        set(pins, 1)[2]
        mov(pins, x)[2]
        set(pins, 0)[1]
        jmp(y_dec, "bit")
        wrap()

    return program
