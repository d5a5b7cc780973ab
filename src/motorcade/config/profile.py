"""Profiles: what the levels in a word mean for one kind of car, read from TOML.

Times are integer milliseconds. The built-in profile is ``classroom`` (`profiles/classroom.toml`); a project may name
another TOML file beside it.
"""

from dataclasses import MISSING, astuple, dataclass, fields, is_dataclass
from functools import cache, lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

from motorcade.car.board import make_levels
from motorcade.config.arguments import instance_of
from motorcade.config.check import Schema, choice, flag, list_of, load, table, whole
from motorcade.config.files import parse, read_text
from motorcade.devices import DEVICES
from motorcade.devices.motor import MOTOR
from motorcade.errors import InputError, Phrase
from motorcade.words.infrared import NEWER_SLOTS, air_us

_MOST = (1 << 20) - 1
# A car that drives on for longer without a command is nobody's car; one that bends more drives in a circle.
_SMALLER = {"failsafe_ms": 2000, "watchdog_ms": 2000, "drift_mrad_per_m": 2000, "stopping_ms": 1000}
_SMALLER |= {"left_duty_percent": 100, "right_duty_percent": 100}
_NEGATIVE = ("drift_mrad_per_m",)


@dataclass(frozen=True, slots=True)
class Infrared:
    """Range of a frame, its unit, the pauses between frames, and how tagged words are passed on."""

    range_mm: int
    unit_us: int
    gap_ms: int
    relay_period_ms: int
    sense_ms: int
    first_interval_ms: int = 110
    last_interval_ms: int = 3520
    redundancy: int = 2
    forget_ms: int = 10_000


@dataclass(frozen=True, slots=True)
class Serial:
    """The serial line; always 8 data bits, no parity, 1 stop bit."""

    baud: int


@dataclass(frozen=True, slots=True)
class Body:
    """The car's size and what its sensors reach; angles are half of the cone, in degrees."""

    diameter_mm: int
    wheel_base_mm: int
    ultrasonic_cone_deg: int
    ultrasonic_range_mm: int
    pir_range_mm: int
    pir_half_angle_deg: int


@dataclass(frozen=True, slots=True)
class FloorSensors:
    """The two floor sensors: how far in front of the axle they are, and how far from each other."""

    ahead_mm: int = 60
    apart_mm: int = 45


@dataclass(frozen=True, slots=True)
class Servo:
    """The steering servo's period and pulse widths, and how far it turns the front wheels at 0 and 180 degrees."""

    period_ms: int
    pulse_0_deg_us: int
    pulse_90_deg_us: int
    pulse_180_deg_us: int
    steering_deg: int


@dataclass(frozen=True, slots=True)
class DriveMotor:
    """The drive motor's largest PWM duty."""

    pwm_max: int


@dataclass(frozen=True, slots=True)
class MeasuredWheels:
    """What wheels do beside what they are told.

    Attributes:
        drift_mrad_per_m: by how much the car turns to the left on each metre of a way that should be straight; to the
            right where it is negative. -2000 to 2000.
        stopping_ms: when it is told to stand, it rolls on as far as it drives in this time. 0 to 1000.
        left_duty_percent, right_duty_percent: the share of its duty that the board gives each motor, 1 to 100. All
            else in a profile is of the car that drives with them.
    """

    drift_mrad_per_m: int = 0
    stopping_ms: int = 0
    left_duty_percent: int = 100
    right_duty_percent: int = 100


@dataclass(frozen=True, slots=True)
class DriveLimits:
    """Limits of a car that is steered over a network; see docs/profiles.md."""

    failsafe_ms: int
    watchdog_ms: int
    hand_over_ms: int
    commands_per_s: int
    stale_ms: int = 150
    arming: bool = False
    acceleration_max_mm_per_s2: int = 0
    obstacle_stop_mm: int = 0
    battery_low_mv: int = 0
    battery_charged_mv: int = 0


@dataclass(frozen=True, slots=True)
class Profile:
    """One kind of car. Each tuple but ``lacks``, names of devices, is indexed by the level that stands in a word."""

    name: str
    durations_ms: tuple[int, ...]
    dwell_ms: tuple[int, ...]
    speeds_mm_s: tuple[int, ...]
    turn_rates_deg_s: tuple[int, ...]
    avoid_radii_mm: tuple[int, ...]
    idle_state_ms: int
    lacks: tuple[str, ...]
    infrared: Infrared
    serial: Serial
    body: Body
    floor: FloorSensors
    servo: Servo
    motor: DriveMotor
    wheels: MeasuredWheels
    drive: DriveLimits

    @property
    def duration_levels(self) -> dict[int, int]:
        """The level of each duration."""
        return {duration: level for level, duration in enumerate(self.durations_ms)}


# The number of levels of each list, and whether its level 0 is always 0.
_LISTS = {
    "durations_ms": (4, True),
    "dwell_ms": (8, False),
    "speeds_mm_s": (4, True),
    "turn_rates_deg_s": (4, True),
    "avoid_radii_mm": (4, False),
}
# The profile's tables, by their names.
_TABLES: dict[str, Any] = {field.name: field.type for field in fields(Profile) if is_dataclass(field.type)}


@cache
def profile_schema() -> Schema:
    """The JSON Schema of a profile. A field that its class gives a default may be left out."""
    lists = {name: _levels(count, starts_at_zero) for name, (count, starts_at_zero) in _LISTS.items()}
    tables = {}
    for name, kind in _TABLES.items():
        schema = table(**{field.name: _schema_of(field) for field in fields(kind)})
        # A table whose keys all have defaults may be left out.
        if not schema["required"]:
            schema["default"] = {}
        tables[name] = schema
    # Every car has wheels.
    devices = (device.name for device in DEVICES if device.steps and device is not MOTOR)
    lacks = list_of(choice(*devices), default=[])
    return table(**lists, idle_state_ms=whole(1, _MOST), lacks=lacks, **tables)


def _levels(count: int, starts_at_zero: bool) -> Schema:
    schema = list_of(whole(1, _MOST), count, count)
    if starts_at_zero:
        schema["prefixItems"] = [{"enum": [0]}]
    return schema


def _schema_of(field: Any) -> Schema:
    if isinstance(field.default, bool):
        return flag(default=field.default)
    most = _SMALLER.get(field.name, _MOST)
    if field.default is MISSING:
        return whole(1, most)
    if field.name in _NEGATIVE:
        return whole(-most, most, default=field.default)
    # Where a key is 0 unless it is there, 0 switches off what it limits.
    return whole(min(field.default, 1), most, default=field.default)


@lru_cache(maxsize=32)
def built_in_profile(name: str) -> Profile:
    """Return the built-in profile called ``name``. Raises MotorcadeError no-such-profile, which lists all."""
    if name not in built_in_profiles():
        raise InputError("no-such-profile", name=name[:40], known=", ".join(built_in_profiles()))
    file = resources.files("motorcade") / "profiles" / f"{name}.toml"
    return parse_profile(file.read_text(encoding="utf-8"), name)


def built_in_profiles() -> list[str]:
    """Return the names of the profiles that come with Motorcade."""
    files = (resources.files("motorcade") / "profiles").iterdir()
    return sorted(file.name.removesuffix(".toml") for file in files if file.name.endswith(".toml"))


def load_profile(name: str, folder: Path = Path()) -> Profile:
    """Return the profile that a project in ``folder`` names: a built-in one, or a ``.toml`` file there.

    Raises MotorcadeError where it isn't there or isn't valid.
    """
    if not instance_of(str, "name", name).endswith(".toml"):
        return built_in_profile(name)
    path = folder / name
    file = Phrase("profile-file", name=name[:40])
    return parse_profile(read_text(path, file), name)


def parse_profile(text: str, name: str) -> Profile:
    """Return the Profile in TOML ``text``. Raises MotorcadeError, which names the key that is wrong."""
    return profile_from_dict(parse(text, "TOML", Phrase("profile-file", name=name)), name)


def profile_from_dict(document: Any, name: str) -> Profile:
    """Return the Profile in a parsed document. Raises MotorcadeError, which names the key that is wrong."""
    file = Phrase("profile-file", name=name)
    values = load(document, profile_schema(), file)
    for key in _LISTS:
        levels = tuple(values[key])
        if list(levels) != sorted(set(levels)):
            raise InputError("levels-not-rising", file=file, key=key, value=values[key])
        values[key] = levels
    values["lacks"] = tuple(values["lacks"])
    for key, kind in _TABLES.items():
        values[key] = kind(**values[key])
    profile = Profile(name=name, **values)
    _check_times(profile, file)
    return profile


def _check_times(profile: Profile, file: Phrase) -> None:
    infrared = profile.infrared
    drive = profile.drive
    longest_ms = air_us(0xFFFFFFFF, infrared.unit_us) / 1000 + infrared.gap_ms
    if infrared.relay_period_ms <= longest_ms:
        times = {"period_ms": infrared.relay_period_ms, "longest_ms": f"{longest_ms:g}"}
        raise InputError("relay-period-too-short", file=file, **times)
    if not 1 < infrared.first_interval_ms <= infrared.last_interval_ms:
        times = {key: getattr(infrared, key) for key in ("first_interval_ms", "last_interval_ms")}
        raise InputError("intervals-not-rising", file=file, **times)
    if infrared.forget_ms > NEWER_SLOTS * profile.dwell_ms[0]:
        times = {"forget_ms": infrared.forget_ms, "slots": NEWER_SLOTS, "most_ms": NEWER_SLOTS * profile.dwell_ms[0]}
        raise InputError("forgets-too-late", file=file, **times)
    if not drive.watchdog_ms < drive.failsafe_ms < drive.hand_over_ms:
        times = {key: getattr(drive, key) for key in ("watchdog_ms", "failsafe_ms", "hand_over_ms")}
        raise InputError("drive-times-not-rising", file=file, **times)
    if drive.battery_low_mv and not drive.battery_low_mv < drive.battery_charged_mv:
        levels = {key: getattr(drive, key) for key in ("battery_low_mv", "battery_charged_mv")}
        raise InputError("battery-levels-not-rising", file=file, **levels)


def levels_of(profile: Profile) -> tuple[int, ...]:
    """Return the profile's integers as `motorcade.car.brain` takes them for ``levels``."""
    infrared = astuple(profile.infrared)[1:]
    return make_levels(profile.durations_ms, profile.dwell_ms, profile.avoid_radii_mm, profile.idle_state_ms, infrared)
