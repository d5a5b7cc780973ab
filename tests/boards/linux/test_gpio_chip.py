"""The pins of a computer with Linux: what gpiozero asks of lgpio, which is mocked here."""

import subprocess
import sys
from types import SimpleNamespace

import pytest

from support.waiting import DEADLINE_S

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="gpiochips are Linux's")
if sys.platform == "linux":
    from gpiozero import Servo
    from gpiozero.pins import local

    from motorcade.boards.computer import Equipment
    from motorcade.boards.lines import WaitingLine
    from motorcade.boards.linux import gpio_chip
    from motorcade.boards.linux.programmed_drive import open_drive
    from motorcade.boards.linux.raspberry_pi import open_car
    from motorcade.config.chips import chip_named
    from motorcade.config.pins import parse_pins
    from motorcade.config.profile import levels_of
    from motorcade.errors import MotorcadeError
    from support.chip_benches import RP2040
    from support.mock_pi import HEAD, STEERED
    from support.strategies import CLASSROOM

    LGPIO = gpio_chip.lgpio
    PI, LINUX = chip_named("raspberry-pi"), chip_named("linux")
RASPBERRY_PI_3B = 0xA02082
TWO_MOTORS = "[left_motor]\nforward = 7\nbackward = 8\n[right_motor]\nforward = 16\nbackward = 26\n"


@pytest.fixture
def kernel(monkeypatch):
    """Mock lgpio and note its calls; pins are inputs until they are claimed as outputs."""
    asked = SimpleNamespace(opened=[], pwm=[], written=[], outputs=set(), fails=False)

    def tx_pwm(handle, pin, frequency, duty):
        if asked.fails:
            raise LGPIO.error("bad PWM")
        asked.pwm.append((pin, frequency, round(duty, 6)))

    answers = {
        "gpiochip_open": lambda chip: asked.opened.append(chip) or 1,
        "gpiochip_close": lambda handle: 0,
        "gpio_claim_input": lambda handle, pin, flags=0: asked.outputs.discard(pin),
        "gpio_claim_output": lambda handle, pin, level=0, flags=0: asked.outputs.add(pin),
        "gpio_get_mode": lambda handle, pin: 2 if pin in asked.outputs else 0,
        "gpio_write": lambda handle, pin, level: asked.written.append((pin, level)),
        "gpio_read": lambda handle, pin: 0,
        "tx_pwm": tx_pwm,
    }
    for name, answer in answers.items():
        monkeypatch.setattr(LGPIO, name, answer)
    monkeypatch.setattr(local, "get_pi_revision", lambda: RASPBERRY_PI_3B)
    return asked


def car_equipment(is_leader=True):
    """Return the equipment of a car without an image."""
    return Equipment(is_leader, 0, levels_of(CLASSROOM), WaitingLine(), None, lambda data: None)


def opened(text=STEERED, is_leader=True, **options):
    """Open a car that is driven."""
    return open_drive(car_equipment(is_leader), parse_pins(HEAD + text, "car.toml"), CLASSROOM, **options)


def test_a_servos_pulses_are_not_rounded_to_whole_percents(kernel):
    board = opened()
    pulses_us = []
    for angle_deg in (0, 1, 90, 180):
        board.apply(angle_deg, 1, 0)
        # At the end of a pulse's 20 ms lgpio uses the last duty that it got.
        frequency, duty = [asked[1:] for asked in kernel.pwm if asked[0] == 19][-1]
        pulses_us.append(duty / 100 / frequency * 1e6)
    assert pulses_us == pytest.approx([500, 511.111, 1500, 2500], abs=0.01)
    board.close()


def test_the_rescue_of_a_steered_car_pulls_its_motor_pins_and_its_horn_low(kernel):
    board = opened(STEERED + "[horn]\nsignal = 20\n", gpio_chip=3)
    where, arguments = board.rescue()
    assert kernel.opened == [3]
    board.close()
    kernel.written.clear()
    module, _, name = where.partition(":")
    getattr(sys.modules[module], name)(*arguments)
    assert kernel.opened == [3, 3]
    assert kernel.written == [(5, False), (6, False), (12, False), (20, False)]
    assert kernel.outputs >= {5, 6, 12, 20}


def test_a_car_with_two_motors_is_driven_and_rescued_too(kernel):
    board = opened(TWO_MOTORS)
    _, (_, _, *low) = board.rescue()
    assert low == ["7", "8", "16", "26"]
    board.apply(180, 1, 255)
    assert [asked for asked in kernel.pwm if asked[2]] == [(16, 100, 100)]
    board.close()


def test_a_car_with_a_servo_runs_its_words(kernel):
    board = open_car(car_equipment(), parse_pins(HEAD + STEERED, "car.toml"), CLASSROOM)
    board.set_wheels(1, 3)
    # The servo's longest pulse is an eighth of its 20 ms.
    assert {asked[0]: asked[1:] for asked in kernel.pwm} == {19: (50, 12.5), 12: (100, 100)}
    board.close()


def test_a_failing_pin_raises_an_oserror(kernel):
    board = opened()
    kernel.fails = True
    with pytest.raises(OSError, match=r"GPIO19 can't be driven: .*bad PWM"):
        board.apply(10, 1, 10)
    kernel.fails = False
    board.close()


def test_lines_of_another_computer_have_their_numbers(kernel):
    factory = gpio_chip.open_gpio(LINUX)
    assert kernel.opened == [0]
    with Servo(231, min_pulse_width=0.0005, max_pulse_width=0.0025, pin_factory=factory):
        assert (231, 50, 7.5) in kernel.pwm
    factory.close()


def test_the_rescue_finds_the_lines_of_another_computer(kernel):
    gpio_chip.pull_low("linux", "", "231")
    assert kernel.opened == [0]
    assert kernel.written == [(231, False)]


def test_a_computer_without_pins_says_so():
    with pytest.raises(MotorcadeError, match="--board simulated") as raised:
        gpio_chip.open_gpio(PI)
    assert raised.value.exit_code == 3
    with pytest.raises(MotorcadeError, match=r"no pins at /dev/gpiochip77"):
        gpio_chip.open_gpio(LINUX, 77)


def test_importing_lgpio_leaves_no_pipe_in_the_working_directory(tmp_path):
    script = "import motorcade.boards.linux.gpio_chip"
    subprocess.run([sys.executable, "-c", script], cwd=tmp_path, check=True, timeout=DEADLINE_S)
    assert list(tmp_path.iterdir()) == []


def test_a_gpiochip_without_permission_names_the_group(kernel, monkeypatch):
    def refuse(chip):
        raise LGPIO.error("can not open gpiochip")

    monkeypatch.setattr(LGPIO, "gpiochip_open", refuse)
    monkeypatch.setattr(gpio_chip.Path, "exists", lambda path: True)
    monkeypatch.setattr(gpio_chip.os, "access", lambda path, mode: False)
    with pytest.raises(MotorcadeError, match=r"usermod -aG gpio") as raised:
        gpio_chip.open_gpio(PI)
    assert raised.value.exit_code == 7


def test_a_pin_file_of_another_kind_of_car_is_refused(kernel):
    with pytest.raises(MotorcadeError, match=r"no wheels: they are either \[left_motor\]"):
        opened(STEERED.replace("drive_motor", "left_motor"))
    with pytest.raises(MotorcadeError, match="two kinds of wheels"):
        opened(STEERED + TWO_MOTORS)
    with pytest.raises(MotorcadeError, match="motorcade install-firmware"):
        open_car(car_equipment(), parse_pins(RP2040, "car.toml"), CLASSROOM)
    with pytest.raises(MotorcadeError, match=r"no receiver in \[infrared\]"):
        opened(is_leader=False)
    assert kernel.opened == []
