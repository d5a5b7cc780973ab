"""Save a program, read it, compile it, and make a program of its words again."""

import tempfile
from pathlib import Path

from motorcade import Program, compile_program, decompile, forward, led, read_program, repeat, right, together

program = Program(
    leader=[repeat(3, together(forward(2, speed=3), led(1, 1)), right(1))],
    followers=[forward(2, speed=3), right(1)],
)

if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "square.motorcade.json"
        program.save(path)
        compiled = compile_program(read_program(path.read_bytes()))
    for word, (place, _) in zip(compiled.words, compiled.origins, strict=True):
        print(f"0x{word:08X}  {place or 'header'}")
    again = decompile(compiled.words)
    print(again.as_json())
    print("The same words again:", compile_program(again).words == compiled.words)
