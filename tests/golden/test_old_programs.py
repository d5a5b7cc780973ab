"""Programs from before leaders could decide compile to the bytes that they had then."""

from pathlib import Path
from zlib import crc32

import pytest

from motorcade import compile_program, read_program

GALLERY = Path(__file__).parents[2] / "src" / "motorcade" / "service" / "gallery"
IMAGES = {
    "dance": 0x939F2CB6,
    "herd": 0xE25B9F3B,
    "listen": 0x0DB2DD24,
    "parade": 0x38863CE4,
    "polite": 0x893775C4,
    "ripple": 0xD83AA3A3,
    "square": 0x8AE1775F,
    "town": 0x2B49B0DA,
    "traffic-light": 0x72BEEA5B,
}


@pytest.mark.parametrize("name", IMAGES)
def test_an_old_program_keeps_its_bytes(name):
    program = read_program((GALLERY / f"{name}.motorcade.json").read_bytes())
    assert crc32(compile_program(program).image) == IMAGES[name]
