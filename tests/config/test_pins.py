"""Pin files: what they say, what is refused and how, and the table and drawing that builders see."""

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

from motorcade.boards.linux.raspberry_pi import motor_pins
from motorcade.boards.wiring import wiring_rows, wiring_svg
from motorcade.config.pins import load_pins, parse_pins
from motorcade.errors import MotorcadeError
from support.command_line import run

FIRMWARE = Path(__file__).parents[2] / "firmware"
SHIPPED = sorted(
    file
    for folder in ("linux/*pins", "micropython/*", "arduino/*", "cars/*")
    for file in FIRMWARE.glob(f"{folder}.toml")
)
HEAD = 'format = "motorcade-pins/1"\nname = "Car"\nchip = "{}"\n'
PI, ESP32, RP2040, UNO, MEGA = (
    HEAD.format(chip) for chip in ("raspberry-pi", "esp32", "rp2040", "arduino-uno", "arduino-mega")
)
PIR = "[pir]\noutput = {}\n"


def test_a_pin_file_says_what_is_where():
    text = PI + "[left_motor]\nbackward = 6\nforward = 5\n" + PIR.format(25) + "[duties]\nturn = [0, 1, 2, 3]\n"
    pins = parse_pins(text, "car.toml")
    assert (pins.name, pins.chip.name) == ("Car", "raspberry-pi")
    assert [(wire.device.key, wire.role.key, wire.pin) for wire in pins.wires] == [
        ("left_motor", "forward", 5),
        ("left_motor", "backward", 6),
        ("pir", "output", 25),
    ]
    assert (pins.has("pir"), pins.has("servo")) == (True, False)
    assert (pins.pin("left_motor", "backward"), pins.pin("left_motor", "enable")) == (6, None)
    assert (pins.drive_duties, pins.turn_duties) == ((0, 85, 170, 255), (0, 1, 2, 3))
    assert motor_pins(pins) == [5, 6]
    # What is printed on a board is as good as a number, in capitals or not.
    for chip, name, pin in (
        (PI, "GPIO25", 25),
        (RP2040, "GP5", 5),
        (ESP32, "io23", 23),
        (UNO, "D5", 5),
        (UNO, "a0", 14),
    ):
        assert parse_pins(chip + PIR.format(f'"{name}"'), "car.toml").pin("pir", "output") == pin
    pins = parse_pins(UNO + "[floor]\nleft = 'A0'\nright = 'A1'\ndark = 'low'\nthreshold = 40\n", "car.toml")
    assert (pins.level("floor", "dark"), pins.threshold_percent("floor"), pins.option("pixels", "count")) == (0, 40, 1)
    # This pin only reads.
    assert parse_pins(ESP32 + PIR.format(34), "car.toml").pin("pir", "output") == 34


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (PI.replace("pins/1", "pins/9") + PIR.format(4), 'format is "motorcade-pins/9"; allowed: "motorcade-pins/1"'),
        (UNO + PIR.format(1), "GPIO1 of Arduino Uno.* is the USB line's"),
        (
            UNO + "[infrared]\nsender = 5\n",
            r"infrared.sender is D5, but on Arduino Uno.* this wire can only be at D11, D3",
        ),
        (MEGA + "[ultrasonic]\ntrigger = 4\necho = 5\n", "this wire can only be at D2, D3, D18, D19, D20, D21"),
        (
            UNO + "[infrared]\nreceiver = 'A9'\n",
            r'infrared.receiver is "A9", but Arduino Uno.* has no such pin; it has D2, ',
        ),
        (
            RP2040 + PIR.format("'D5'"),
            'pir.output is "D5", but Raspberry Pi Pico .* has no such pin; it has 0-22, 26-28',
        ),
        (UNO + PIR.format("'A7'"), "pir.output is A7, and this pin of Arduino Uno.* only measures a voltage"),
        (RP2040 + "[floor]\nleft = 2\nright = 26\nthreshold = 40\n", "can only be at GPIO26 .*: these pins measure"),
        (
            UNO + "[left_motor]\ndirection = 4\nforward = 7\nenable = 5\n",
            r"\[left_motor\] has direction, enable, forward, ",
        ),
        (UNO + "[left_motor]\ndirection = 4\n", "left_motor.enable is missing"),
        (
            UNO + "[ultrasonic]\nsignal = 4\necho = 5\n",
            "don't belong together; it has one of these: trigger, echo / sig",
        ),
        (PI + "[pixels]\nsignal = 4\n", "a car with the chip Raspberry Pi can't have pixels.signal; leave it out"),
        (UNO + "[servo]\nsignal = 4\n", "can't have servo.signal"),
        (PI + "[floor]\nleft = 4\nright = 7\nthreshold = 40\n", "can't have floor.threshold; leave it out"),
        (UNO + "[pixels]\nsignal = 4\ncount = 99\n", "pixels.count is 99"),
        (UNO + "[floor]\nleft = 4\nright = 7\ndark = 'black'\n", 'floor.dark is "black"; allowed: "high", "low"'),
        (MEGA + "[infrared]\nsender = 11\n", "this wire can only be at D10"),
        (PI, "no device is connected; devices are left_motor"),
        (PI + "[leds]\n", r"\[leds\] names no pin; known are led_0, led_1, led_2, led_3"),
        (PI + "[left_motor]\nforward = 5\n", "left_motor.backward is missing"),
        (PI + PIR.format(28), "pir.output is 28, but Raspberry Pi has no such pin; it has 2-27"),
        (PI + PIR.format(0), "GPIO0 of Raspberry Pi is for the memory of add-on boards; choose another pin"),
        (ESP32 + PIR.format(6), "GPIO6 of ESP32 leads to the flash memory"),
        (ESP32 + PIR.format(20), "ESP32 has no such pin; it has 0, 2, 4-5, 12-19, 21-23, 25-27, 32-39"),
        (ESP32 + "[pixels]\nsignal = 34\n", "GPIO34 of ESP32 only reads, and this wire has to be driven"),
        (RP2040 + PIR.format(25), "GPIO25 of .* is the board's own LED"),
        (
            PI + PIR.format(17) + "[leds]\nled_0 = 4\nled_3 = 17\n",
            r"leds.led_3 and pir.output are both on GPIO17 \(11\); give one of them another pin",
        ),
        (PI + PIR.format(4) + "[duties]\ndrive = [1, 2, 3, 4]\n", "must begin at 0 and rise"),
        (PI + PIR.format(4) + "[duties]\ndrive = [0, 9, 9, 255]\n", "must begin at 0 and rise"),
    ],
)
def test_a_pin_file_that_cannot_be_is_refused_in_a_sentence(text, says):
    with pytest.raises(MotorcadeError, match=says) as refused:
        parse_pins(text, "car.toml")
    assert re.search(r"[\u4e00-\u9fff]", refused.value.sentence("zh"))


def test_a_pin_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(MotorcadeError, match=r"missing\.toml can't be read"):
        load_pins(tmp_path / "missing.toml")
    (tmp_path / "noise.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(MotorcadeError, match="it is not text in UTF-8 or UTF-16"):
        load_pins(tmp_path / "noise.toml")


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: "/".join(path.parts[-2:]))
@pytest.mark.parametrize("language", ["en", "zh"])
def test_each_wire_is_a_row_of_the_table_and_a_line_of_the_drawing(path, language):
    pins = load_pins(path)
    rows = wiring_rows(pins, language)
    assert {wire.role.key for wire in pins.wires} & {"forward", "direction"}
    assert [row.pin for row in rows] == [wire.pin for wire in pins.wires]
    svg = ElementTree.fromstring(wiring_svg(pins, language))
    assert len(svg.findall("{*}path")) == len(rows)
    drawn = [text.text for text in svg.findall("{*}text")]
    for row in rows:
        assert {row.label, row.terminal, row.part, *(component.value for component in row.between)} <= set(drawn)
        assert not row.supply or row.supply in drawn
    _, _, width, height = map(float, svg.attrib["viewBox"].split())
    for text in svg.findall("{*}text"):
        assert 0 < float(text.attrib["x"]) < width
        assert 0 < float(text.attrib["y"]) < height


def test_each_terminal_has_its_own_supply_and_what_protects_the_pin():
    """A receiver at 5 V can damage a pin that takes 3.3 V; so can the echo."""
    wires = "[infrared]\nreceiver = 2\nsender = 11\n[ultrasonic]\ntrigger = 4\necho = 3\n"
    found = {}
    for chip in (UNO, RP2040):
        found[chip] = {row.terminal: row for row in wiring_rows(parse_pins(chip + wires, "car.toml"), "en")}
    assert found[RP2040]["OUT, VS1838B"].supply == "3.3 V, GND"
    assert found[UNO]["OUT, VS1838B"].supply == "5 V, GND"
    assert found[RP2040]["ECHO"].components == "2 kΩ to GND, 1 kΩ in series"
    assert found[UNO]["ECHO"].components == ""
    for rows in found.values():
        assert rows["LED 940 nm, 33 Ω"].supply == "5 V"
        assert rows["LED 940 nm, 33 Ω"].components == "1 kΩ in series, transistor NPN, emitter to GND"


def test_a_drawing_holds_whatever_a_car_is_called():
    pins = parse_pins(PI.replace("Car", "<b>&</b>") + PIR.format(4), "car.toml")
    svg = ElementTree.fromstring(wiring_svg(pins, "en"))
    assert svg.attrib["aria-label"] == "<b>&</b>: Raspberry Pi"


MOTOR = "[left_motor]\nforward = {}\nbackward = {}\n"


@pytest.mark.parametrize(
    ("text", "warned"),
    [
        (UNO + "[floor]\nleft = 18\nright = 13\n", ["floor.right is at D13, which has the board's LED"]),
        (UNO + "[leds]\nled_0 = 13\n", []),
        (MEGA + PIR.format(13), ["pir.output is at D13"]),
        (MEGA + MOTOR.format(13, 12) + "enable = 5\n", []),
        (MEGA + MOTOR.format(7, 8) + "enable = 13\n", ["left_motor.enable is at D13, which blinks"]),
        (ESP32 + PIR.format(0), ["GPIO0, which starts the boot loader"]),
        (ESP32 + "[leds]\nled_0 = 2\nled_1 = 12\nled_2 = 15\nled_3 = 4\n", ["led_0", "led_1", "led_2"]),
        (ESP32 + "[infrared]\nreceiver = 14\nsender = 5\n", ["infrared.sender is at GPIO5"]),
        (PI + MOTOR.format(5, 6), ["left_motor.forward is at GPIO5 (29)", "left_motor.backward is at GPIO6 (31)"]),
        (PI + MOTOR.format(5, 6) + "enable = 12\n", []),
        (PI + PIR.format(4), []),
        (PI + PIR.format(2), ["pir.output is at GPIO2 (3), which has a fixed pull-up"]),
        (PI + "[ultrasonic]\ntrigger = 8\necho = 24\n", []),
        (RP2040 + MOTOR.format(0, 1), []),
    ],
)
def test_a_pin_that_does_something_at_power_on_is_warned_of_where_it_matters(text, warned):
    warnings = parse_pins(text, "car.toml").warnings
    assert len(warnings) == len(warned)
    for warning, beginning in zip(warnings, warned, strict=True):
        assert beginning in warning.sentence("en")
        assert warning.sentence("zh") != warning.sentence("en")


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_no_shipped_car_is_warned_of(path):
    assert load_pins(path).warnings == ()


@pytest.mark.parametrize(
    ("command", "chip"),
    [
        (("arduino-library", "--pins"), UNO),
        (("install-firmware", "--dry-run", "--pins"), ESP32),
        (("--language", "zh", "install-firmware", "--dry-run", "--pins"), ESP32),
    ],
)
def test_a_command_that_reads_pins_prints_the_warnings(tmp_path, command, chip):
    (tmp_path / "mine.toml").write_text(chip + PIR.format(13 if chip == UNO else 12), encoding="utf-8")
    output = ("-o", tmp_path / "new") if chip == UNO else ()
    done = run(*command, tmp_path / "mine.toml", *output)
    assert done.code == 0, done.err
    assert re.match(r"motorcade: mine.toml: pir.output (is at|接在) ", done.err)
