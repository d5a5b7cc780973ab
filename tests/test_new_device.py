"""A made-up device, declared in a copy of the sources as CONTRIBUTING.md says, reaches all that follows."""

import pytest

from support.source_copy import SourceCopy

PATCHES = "patches: tuple[Corners, ...] = ()\n"
# A bumper: no bit is free, so it takes that of the PIR sensor.
BUMPER = '''"""The bumper: two switches at the front."""

from motorcade.devices.declaration import *

TOUCHED = Column("touched", "uint8", "uint8", limits=(0, 3))

BUMPER = Device(
    "bumper",
    bits=(Bits("bumper", 12, 12, "stands still while something is touched", "made up"),),
    group="bumper",
    hue=300,
    steps=(
        StepKind(
            "bumper",
            "Stand still while something is touched.",
            Block("sense", "M4 12h16"),
            inputs=(seconds(),),
            sets=(("bumper", 1),),
            accompanies=True,
        ),
    ),
    methods=(Method("touches", "Return which switches are closed.", returns="bits", missing="0", shown=TOUCHED),),
    senses=(Sense("touches", "touches", "the switches that are closed, 1 the left plus 2 the right one"),),
    parts=(
        Part("bumper", "GND", (Role("left", False, "NO left"), Role("right", False, "NO right")), read_by="touches"),
    ),
    things=(Thing("kerb", "kerbs", "ends", "the kerb"),),
)
'''
PROBE = """
from scripts.world_types import world_types

from motorcade import bumper, compile_program, decompile, Program, together, forward
from motorcade.car.board import Board
from motorcade.car.senses import NOTHING
from motorcade.config.pins import parse_pins
from motorcade.firmware.arduino_library import settings_header
from motorcade.config.profile import built_in_profile
from motorcade.engine.moment import PICTURED, moment_bytes
from motorcade.mats import parse_mat
from motorcade.mats.document import document_of
from motorcade.words.formats import CONTROL

class Touched(Board):
    def read_inputs(self, part):
        return 2 if part == "bumper" else 0

print(CONTROL.field("bumper").low, NOTHING.touches, Board().touches(), Touched().senses(0).touches)
program = Program([together(forward(1), bumper())])
words = compile_program(program).words
print(words[1] >> 12 & 1, decompile(words).leader == program.leader)
car = 'format = "motorcade-pins/1"\\nname = "B"\\nchip = "arduino-uno"\\n'
pins = parse_pins(car + "[bumper]\\nleft = 18\\nright = 13\\n", "b.toml")
print("{18, 13},  // bumper" in settings_header(pins, built_in_profile("classroom")))
table = "[[kerb]]\\nfrom_m = [0, 1]\\nto_m = [2, 3]\\n"
mat = parse_mat('format = "motorcade-mat/1"\\nname = "m"\\n' + table, "m", "TOML")
print(mat.kerbs, document_of(mat)["kerb"], PICTURED["touched"], moment_bytes(4))
print("touched: Uint8Array;  // 0 to 3" in world_types(), '"kerb": "ends"' in world_types())
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy of the sources in which the bumper has the place of the PIR sensor; what is generated is written."""
    copy = SourceCopy(tmp_path_factory.mktemp("bumper"))
    (copy.package / "devices" / "bumper.py").write_text(BUMPER, encoding="utf-8")
    changes = {
        "devices/__init__.py": (
            ("motorcade.devices.pir import PIR", "motorcade.devices.bumper import BUMPER"),
            ("VOICE, PIR,", "VOICE, BUMPER,"),
        ),
        "car/brain.py": (("PIR_AT", "BUMPER_AT"), ("senses.person", "senses.touches")),
        "mats/model.py": ((PATCHES, f"{PATCHES}    kerbs: tuple[Wall, ...] = ()\n"),),
        "engine/moment.py": (("sends: Flags\n", "sends: Flags\n    touched: Bytes\n"),),
    }
    for path, replacements in changes.items():
        copy.change(f"src/motorcade/{path}", *replacements)
    made = copy.run("-c", "from scripts.generate import SOURCES, write; write(SOURCES, check=False)")
    assert made.returncode == 0, made.stderr
    return copy


def test_a_declared_device_reaches_words_steps_boards_pins_arduino_mats_and_pictures(copy):
    ran = copy.run("-c", PROBE)
    assert ran.returncode == 0, ran.stderr
    kerb = "((0.0, 1.0, 2.0, 3.0),) [{'from_m': [0.0, 1.0], 'to_m': [2.0, 3.0]}] uint8 72"
    assert ran.stdout.split("\n")[:5] == ["12 0 0 2", "1 True", "True", kerb, "True True"]
    header = (copy.folder / "firmware/arduino/src/MotorcadeBoard.h").read_text(encoding="utf-8")
    assert "virtual uint8_t touches() { return 0; }" in header
    assert "sees_person" not in header


def test_texts_that_a_new_device_lacks_are_named_in_a_sentence(copy):
    ran = copy.run("-m", "scripts.generate", "--check")
    said = ran.stdout + ran.stderr
    assert ran.returncode == 1
    assert "src/motorcade/locales/zh.json lacks page.blocks.bumper: the text of the block" in said
    assert "src/motorcade/locales/en.json lacks phrases.device-bumper: the name of the part" in said
    assert "Traceback" not in said
