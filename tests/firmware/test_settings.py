"""What a pin file becomes on a chip, and the sentence where the chip can't."""

import pytest

from motorcade.car.brain import VOICE_GO
from motorcade.config.pins import VoiceMap, parse_pins
from motorcade.errors import MotorcadeError
from motorcade.firmware.car_files import settings_of
from support.chip_benches import ESP32, RP2040
from support.strategies import CLASSROOM

VOICE_MAP = VoiceMap(9600, ((b"go", VOICE_GO),))


def refused(text: str, voice=VOICE_MAP) -> str:
    with pytest.raises(MotorcadeError) as problem:
        settings_of(parse_pins(text, "mine.toml"), CLASSROOM, True, voice=voice)
    return str(problem.value)


def test_settings_that_the_chip_does_not_support_are_refused():
    assert "--voice-map" in refused(ESP32 + "[voice]\nreceive = 16\n", voice=None)
    at_17 = ESP32.replace("led_0 = 18", "led_0 = 17")
    assert "GPIO17" in refused(at_17 + "[voice]\nreceive = 16\n")
    assert "no UART" in refused(RP2040 + "[serial]\ntransmit = 9\nreceive = 8\n")
    assert "different UARTs" in refused(RP2040 + "[serial]\ntransmit = 0\nreceive = 9\n")
    assert "the other one" in refused(RP2040 + "[serial]\ntransmit = 8\nreceive = 9\n[voice]\nreceive = 21\n")
    pi = 'format = "motorcade-pins/1"\nname = "Pi"\nchip = "raspberry-pi"\n[pir]\noutput = 5\n'
    assert "motorcade car run" in refused(pi)
    uno = pi.replace("raspberry-pi", "arduino-uno").replace("output = 5", 'output = "D7"')
    assert "motorcade arduino-library" in refused(uno)


@pytest.mark.parametrize(("pins", "uart"), [((0, 1), 0), ((4, 5), 1), ((8, 9), 1), ((12, 13), 0), ((16, 17), 0)])
def test_an_rp2040s_pins_lead_to_their_uart(pins, uart):
    bare = 'format = "motorcade-pins/1"\nname = "Bare"\nchip = "rp2040"\n'
    text = bare + f"[serial]\ntransmit = {pins[0]}\nreceive = {pins[1]}\n"
    assert settings_of(parse_pins(text, "bare.toml"), CLASSROOM, True)["uarts"] == {"serial": uart}
