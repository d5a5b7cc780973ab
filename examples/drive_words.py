"""Make, read and refuse the words that steer a car over a socket."""

from motorcade import DRIVE, WordError

word = DRIVE.encode(angle=40, direction=1, speed=150)
print(f"{word} = 0x{word:08X}")
print(DRIVE.decode(word))

try:
    DRIVE.encode(angle=181, direction=1, speed=150)
except WordError as problem:
    print(f"Not sent: {problem}")
