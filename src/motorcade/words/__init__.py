"""What a word is: its fields, its image, its infrared frame, its upload over a serial line. Portable, without I/O."""

# Names for annotations: how many bits an integer needs in C (`scripts/exports`). In Python they are all int. A plain
# ``int`` is 0 to 2^32 - 1.
uint8 = int
uint16 = int
# An index of a memory, and the bits of the integer there.
uint8_at = int
uint16_at = int
