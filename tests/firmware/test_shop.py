"""Cars from shops: what is listed, what the commands make of them, and that each follows."""

import json
from types import ModuleType

import driven_car
import pytest

from motorcade.car.brain import FORWARD, LEFT, RIGHT
from motorcade.config.profile import built_in_profile
from motorcade.firmware.car_files import LIBRARY, START, board_files, settings_of
from motorcade.firmware.shop import described, shop_car, shop_cars
from motorcade.firmware.shortened import joined
from motorcade.words.infrared import frame_durations_us, to_frame
from support.command_line import run

CARS = shop_cars()
PICOS = [car for car in CARS if shop_car(car).chip.name == "rp2040"]
FRAMES = 60


def test_the_list_says_what_each_car_can_do():
    done = run("cars", "shop")
    assert done.code == 0, done.err
    assert done.err == ""
    for car in CARS:
        assert f"{car} " in done.out
    can = {car["name"]: car["can"] for car in json.loads(run("cars", "shop", "--json").out)}
    assert can["mbot"] == ["leads", "follows", "obstacles", "lines"]
    assert can["picogo"] == ["follows", "obstacles"]
    assert all("follows" in abilities for abilities in can.values())


def test_a_part_that_no_source_confirms_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr("motorcade.firmware.shop.firmware_folder", lambda name: tmp_path)
    pins = (
        'format = "motorcade-pins/1"\nname = "Toy"\nchip = "rp2040"\n[button]\nsignal = "GP2"\n[horn]\nsignal = "GP3"\n'
    )
    (tmp_path / "toy.toml").write_text(pins + '[sources]\nbutton = "its manual"\n', encoding="utf-8")
    assert described("toy")["unconfirmed"] == ["horn"]
    assert "Toy: no source confirms the pins of horn" in run("cars", "shop").err


@pytest.mark.parametrize("car", CARS)
def test_a_car_has_a_profile_of_its_own(car):
    profile = built_in_profile(car)
    assert profile.body.diameter_mm > profile.body.wheel_base_mm
    # Cars of all kinds understand each other.
    assert profile.infrared == built_in_profile("classroom").infrared


@pytest.mark.parametrize(
    ("arguments", "leads", "note"), [([], False, ""), (["--role", "leader"], True, "no infrared LED")]
)
def test_a_car_that_cannot_send_follows_unless_it_is_told_to_lead(arguments, leads, note):
    done = run("install-firmware", "--car", "picogo", "--dry-run", "--json", *arguments)
    assert done.code == 0, done.err
    assert json.loads(done.out)["settings"]["is_leader"] == leads
    assert note in done.err
    assert bool(done.err) == leads


def test_a_car_without_infrared_leads_and_so_runs_its_own_words(tmp_path):
    pins = tmp_path / "pins.toml"
    pins.write_text(
        'format = "motorcade-pins/1"\nname = "Alone"\nchip = "rp2040"\n[pir]\noutput = "GP2"\n', encoding="utf-8"
    )
    done = run("install-firmware", "--pins", pins, "--dry-run", "--json")
    assert done.code == 0, done.err
    assert json.loads(done.out)["settings"]["is_leader"]


def test_a_command_makes_a_car_by_its_name(tmp_path):
    done = run("install-firmware", "--car", "Freenove-Pico", "--dry-run", "--json")
    settings = json.loads(done.out)["settings"]
    assert settings["pins"]["left_rear_motor"] == {"forward": 21, "backward": 20}
    assert settings["options"]["pixels"] == {"count": 8}
    done = run("arduino-library", "-o", tmp_path, "--car", "elegoo-v4", "--role", "follower")
    assert done.code == 0, done.err
    header = (tmp_path / "Motorcade/examples/Car/car.h").read_text(encoding="utf-8")
    assert "{NO_PIN, NO_PIN, 6, 8, 1},  // left_motor" in header
    assert "24,  // floor_threshold" in header


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (
            ("install-firmware", "--dry-run", "--car", "mbot"),
            "MicroPython cars have esp32 / rp2040, and this is Arduino",
        ),
        (
            ("install-firmware", "--dry-run", "--car", "segway"),
            "known are elegoo-v4, freenove-pico, mbot, picogo, yahboom",
        ),
        (("arduino-library", "--car", "segway"), "no car from a shop is called 'segway'"),
        (("arduino-library", "-o", "x", "--car", "picogo"), "lights WS2812 on an Uno, a Nano or a Mega alone"),
        (("arduino-library", "-o", "x", "--car", "mbot", "--pins", __file__), "--car and --pins exclude each other"),
    ],
)
def test_what_cannot_be_is_refused_in_a_sentence(arguments, says):
    done = run(*arguments)
    assert done.code == 2
    assert says in done.err
    assert says not in run("--language", "zh", *arguments).err or "exclude" in says


def turning(chip, pins, motor: str) -> int:
    """Return a motor's duty, below 0 for backward."""
    wires = pins[motor]
    forward, backward = wires["forward"], wires["backward"]
    if "enable" in wires:
        return (chip.levels.get(forward, 0) - chip.levels.get(backward, 0)) * chip.duties[wires["enable"]]
    return chip.duties[forward] - chip.duties[backward]


@pytest.mark.parametrize("name", PICOS)
def test_a_car_with_a_pico_follows(name, monkeypatch):
    """All frames of one behind the other, each of which turns the wheels another way and lights another colour.

    The car's modules are joined, as on a chip.
    """
    settings = settings_of(shop_car(name), built_in_profile(name), False)
    whole = ModuleType("whole")
    exec(joined(board_files(settings), LIBRARY, START)[START], whole.__dict__)
    for used in ("load_settings", "open_board", "Car"):
        monkeypatch.setattr(driven_car, used, getattr(whole, used))
    bench = driven_car.Bench(settings, "rp2")
    car = bench.open()
    sides = {"left": [], "right": []}
    for motor in bench.pins:
        if motor.endswith("_motor"):
            sides[motor.split("_")[0]].append(motor)
    signs = {FORWARD: (1, 1), LEFT: (-1, 1), RIGHT: (1, -1)}
    for number in range(FRAMES):
        direction = (LEFT, FORWARD, RIGHT)[number % 3]
        word = 1 << 31 | 1 << 29 | direction << 27 | 2 << 25 | 3 << 23 | (number % 4) << 21 | 3 << 19
        frame = to_frame(word)
        bench.hear_frame(frame)
        for _ in range(sum(frame_durations_us(frame)) // 5000 + 2):
            car.tick()
            bench.clock.sleep_ms(5)
        duty = 170 * 65535 // 255
        for side, sign in zip(("left", "right"), signs[direction], strict=True):
            assert [turning(bench.chip, bench.pins, motor) for motor in sides[side]] == [sign * duty] * len(sides[side])
