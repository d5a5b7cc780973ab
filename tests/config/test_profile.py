"""What a level means: the built-in cars, and files for others."""

from importlib import resources
from pathlib import Path

import pytest

from motorcade import Program, compile_program, load_profile, wait
from motorcade.config import profile as cars
from motorcade.config.profile import built_in_profile, built_in_profiles, parse_profile
from motorcade.errors import MotorcadeError

TEXT = (resources.files("motorcade") / "profiles" / "classroom.toml").read_text(encoding="utf-8")


def test_the_classrooms_cars_are_the_protocols() -> None:
    # What has a default is in the file too.
    assert built_in_profile("classroom") == cars.Profile(
        "classroom",
        durations_ms=(0, 1000, 2000, 3000),
        dwell_ms=(1000, 2000, 3000, 4000, 5000, 6000, 7000, 8000),
        speeds_mm_s=(0, 100, 200, 300),
        turn_rates_deg_s=(0, 30, 60, 90),
        avoid_radii_mm=(100, 200, 300, 400),
        idle_state_ms=100,
        lacks=(),
        infrared=cars.Infrared(range_mm=1000, unit_us=560, gap_ms=5, relay_period_ms=250, sense_ms=6),
        serial=cars.Serial(115200),
        body=cars.Body(150, 120, 15, 2000, 3000, 55),
        floor=cars.FloorSensors(),
        servo=cars.Servo(20, 500, 1500, 2500, 35),
        motor=cars.DriveMotor(255),
        wheels=cars.MeasuredWheels(),
        drive=cars.DriveLimits(failsafe_ms=300, watchdog_ms=200, hand_over_ms=5000, commands_per_s=100),
    )


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("durations_ms = [0, 1000, 2000, 3000]", "durations_ms = [0, 1000, 2000]", "durations_ms"),
        ("durations_ms = [0, 1000, 2000, 3000]", "durations_ms = [10, 1000, 2000, 3000]", "durations_ms"),
        ("durations_ms = [0, 1000, 2000, 3000]", "durations_ms = [0, 2000, 1000, 3000]", "durations_ms"),
        ("durations_ms = [0, 1000, 2000, 3000]", "durations_ms = [0, 1000, 1000, 3000]", "durations_ms"),
        ("durations_ms = [0, 1000, 2000, 3000]", "", "durations_ms"),
        ("dwell_ms = [1000, ", "dwell_ms = [0, ", "dwell_ms"),
        ("avoid_radii_mm = [100, 200", "avoid_radii_mm = [300, 200", "avoid_radii_mm"),
        ("idle_state_ms = 100", "idle_state_ms = 100\ndoors = 4", "doors"),
        ("[infrared]", "[ultraviolet]", "ultraviolet"),
        ("unit_us = 560", "unit_us = 560\ncolour = 1", "infrared.*colour"),
        ("last_interval_ms = 3520", "last_interval_ms = 109", "last_interval_ms is 109"),
        ("relay_period_ms = 250", "relay_period_ms = 90", "infrared.relay_period_ms"),
        ("failsafe_ms = 300", "failsafe_ms = 200", "drive.watchdog_ms is 200, failsafe_ms 200"),
        ("forget_ms = 10000", "forget_ms = 15001", "forget_ms is 15001; at most 15000 ms"),
        ("hand_over_ms = 5000", "hand_over_ms = 300", "hand_over_ms 300; each must be shorter"),
        ("battery_low_mv = 0", "battery_low_mv = 6400", "drive.battery_low_mv is 6400 and battery_charged_mv 0"),
        ("lacks = []", 'lacks = ["motor"]', "lacks.*allowed.*pir"),
        ("drift_mrad_per_m = 0", "drift_mrad_per_m = -2001", "allowed: a whole number from -2000 to 2000"),
        ("stopping_ms = 0", "stopping_ms = -1", "allowed: a whole number from 0 to 1000"),
        ("failsafe_ms = 300", "failsafe_ms = 2001", "allowed: a whole number from 1 to 2000"),
        ("idle_state_ms = 100", "idle_state_ms = 1048576", "allowed: a whole number from 1 to 1048575"),
    ],
)
def test_what_is_wrong_in_a_profile_is_named(old: str, new: str, said: str) -> None:
    assert old in TEXT
    with pytest.raises(MotorcadeError, match=f"(?s)mine.*{said}") as refused:
        parse_profile(TEXT.replace(old, new), "mine")
    assert refused.value.sentence("zh").startswith("车型文件 mine")


def test_an_unknown_profile_is_answered_with_those_there_are() -> None:
    assert {"classroom", "e-puck", "mbot"} <= set(built_in_profiles())
    for name in ("porsche", "", "../classroom", "..\\classroom", "classroom.toml/"):
        with pytest.raises(MotorcadeError, match="classroom"):
            built_in_profile(name)


def test_a_built_in_profile_is_found_from_any_folder_and_one_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    assert load_profile("classroom", tmp_path) == built_in_profile("classroom")
    with pytest.raises(MotorcadeError, match=r"mine\.toml"):
        load_profile("mine.toml", tmp_path)
    (tmp_path / "mine.toml").write_bytes(b"\xff" + TEXT.encode())
    with pytest.raises(MotorcadeError, match=r"mine\.toml"):
        load_profile("mine.toml", tmp_path)


def test_a_program_whose_profile_is_not_at_hand_is_not_compiled() -> None:
    with pytest.raises(MotorcadeError, match=r"mine\.toml"):
        compile_program(Program([wait(1)], profile="mine.toml"))


def test_a_file_without_the_limits_of_drivers_has_none() -> None:
    keys = ("stale_ms", "arming", "acceleration_max", "obstacle_stop", "battery_low", "battery_charged")
    old = "\n".join(line for line in TEXT.splitlines() if not line.startswith(keys))
    assert parse_profile(old, "classroom").drive == built_in_profile("classroom").drive
