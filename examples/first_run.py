"""Take a program from blocks to tracks, as `make demo` shows.

Compile a project to an image, send it over a real connection to a simulated leader, which answers, and let one leader
and five followers drive for 30 simulated seconds by the image that the leader then holds.
"""

import tempfile
from contextlib import closing
from pathlib import Path

from rich.console import Console

from motorcade import compile_program, load_profile, read_program, simulate
from motorcade.boards.computer import ImageStore, simulated_car
from motorcade.boards.lines import TcpPort
from motorcade.cli.console import words_table
from motorcade.cli.output import print_diagnostics
from motorcade.cli.run_tables import cars_table
from motorcade.upload.serial_port import upload

PROJECT = Path(__file__).with_name("parade.motorcade.json")
PICTURE = Path("build") / "parade.png"


def main() -> None:
    """Compile, upload, verify, drive, draw."""
    console = Console()
    program = read_program(PROJECT.read_bytes())
    profile = load_profile(program.profile, PROJECT.parent)
    compiled = compile_program(program, profile)
    print_diagnostics(compiled.diagnostics, console)
    console.print(words_table(compiled.words, profile))

    with tempfile.TemporaryDirectory() as folder:
        store = ImageStore(Path(folder) / "leader.image")
        with closing(TcpPort("127.0.0.1", 0)) as line, simulated_car(line, store, profile):
            answer = upload(line.address, compiled.image, profile.serial.baud)
        console.print(f"Uploaded {len(compiled.image)} bytes to {line.address}. Verified, the car answered: {answer}")
        image = store.load()

    PICTURE.parent.mkdir(exist_ok=True)
    run = simulate(image or b"", followers=5, seconds=30, profile=profile, record=[PICTURE])
    console.print(cars_table(run))
    console.print(f"Where they drove: {PICTURE}")


if __name__ == "__main__":
    main()
