"""The commands upload and readback with an emulated Uno at the port."""

import pytest
import serial

from motorcade.upload import serial_port
from support.command_line import PARADE, run
from support.emulated_chips import UNO
from support.emulated_uploads import image_of
from support.serial_handlers import protocol_chip

PORT = "chip://uno"


@pytest.fixture
def uno(world, car_program, monkeypatch):
    """An emulated Uno at PORT; the uploader's clock is the chip's."""
    program = car_program(True)
    car = world.add(UNO, program.elf, program.symbols)
    world.run(50)
    monkeypatch.setattr(serial, "protocol_handler_packages", ["support.serial_handlers"])
    monkeypatch.setattr(serial_port, "monotonic_ms", lambda: world.now_ms)
    monkeypatch.setattr(protocol_chip, "plugged", [(world, car)])
    return car


def test_a_program_is_uploaded_and_read_back(uno, tmp_path) -> None:
    done = run("upload", PARADE, "--port", PORT)
    assert (done.code, "verified" in done.out) == (0, True), done.err
    assert run("readback", "--port", PORT, "-o", tmp_path / "held.image").code == 0
    assert run("compile", PARADE, "-o", tmp_path / "sent.image").code == 0
    assert (tmp_path / "held.image").read_bytes() == (tmp_path / "sent.image").read_bytes()


@pytest.mark.parametrize(("language", "says"), [("en", "at most 125"), ("zh", "最多能存 125")])
def test_a_program_that_is_too_long_is_refused_in_a_sentence(uno, tmp_path, language, says) -> None:
    assert run("upload", PARADE, "--port", PORT).code == 0
    (tmp_path / "long.image").write_bytes(image_of(140))
    done = run("upload", tmp_path / "long.image", "--port", PORT, "--language", language)
    assert done.code == 8
    assert says in done.err
    assert "140" in done.err
    assert run("readback", "--port", PORT, "-o", tmp_path / "held.image").code == 0
