"""What time costs on a microcontroller: one table, with the source of each figure. Portable.

Instructions are those that MicroPython's WebAssembly build executes (meter.mjs counts them). A cycle-accurate Pico with
MicroPython 1.28 gave the time (issue 15): `parse_image_bytes` of 511 words took 492 ms, which is 7.26 million
instructions, or 68 ns each; a byte from the USB line 272 µs, 4,900 instructions, 56 ns each. C code in a short loop is
faster: the import of the car's .py files, most of it the compiler, took 2.2 s for 130 million instructions, 17 ns each.
"""

from collections import namedtuple

Costs = namedtuple(
    "Costs",
    (
        "hz",
        "instruction_ns",
        "call_us",
        "hard_us",
        "soft_us",
        "soft_waiting",
        "collect_us",
        "erase_us",
        "page_us",
        "file_us",
        "stdin_ring_bytes",
        "uart_ring_bytes",
    ),
)
"""
hz
    the frequency for which the times below hold; the chip may run with another.
instruction_ns
    one instruction of the WebAssembly build.
call_us
    a call of one of MicroPython's functions in C, such as ticks_ms.
hard_us, soft_us
    from an edge to the first line of its handler, hard and soft; a handler takes as long once more.
soft_waiting
    how many soft interrupts may wait for the program: MICROPY_SCHEDULER_DEPTH. Others are lost.
collect_us
    gc.collect() with the live objects of a car from .mpy files that holds the largest image, in a heap of 200 KB: 0.31
    million instructions in a short loop, 5.3 ms (`benchmarks/chips.py`), and 5 ms for code in the flash: where 15.4 ms
    were counted, MicroPython 1.28 on an emulated RP2040 took up to 20.3. No soft interrupt runs meanwhile;
    hard ones do.
erase_us, page_us
    erasing a sector of 4 KB and writing a page of 256 bytes: typical and longest, by the data sheet of a Pico's flash
    (W25Q16JV, 9.6). No interrupt runs meanwhile. An ESP32's flashes are of that kind.
file_us
    the rest of storing an image, littlefs's own work: MicroPython 1.28 on an emulated RP2040 took 65 to 75 ms in all.
stdin_ring_bytes, uart_ring_bytes
    what the line of the prompt and a UART with its default buffer hold until they are read; None where the sender
    waits (USB).
"""

# An ESP32 is twice as fast where its program asks for 240 MHz, and so is the program here; nobody measured that.
COSTS = {
    "rp2": Costs(125_000_000, 60, 3, 10, 100, 8, 10_500, (45_000, 400_000), (400, 3_000), 17_000, None, 256),
    "esp32": Costs(240_000_000, 30, 2, 10, 100, 8, 5_300, (45_000, 400_000), (400, 3_000), 10_000, 260, 256),
}
# With which frequency a chip begins: MicroPython's for boards in general.
POWER_ON_HZ = {"rp2": 125_000_000, "esp32": 160_000_000}
