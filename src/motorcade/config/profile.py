"""What the levels in a word mean for one kind of car: a TOML file, read once and checked.

Times are integer milliseconds. The built-in profile is ``classroom``
(`profiles/classroom.toml`); a project may name another TOML file beside it.
"""

import tomllib
from dataclasses import dataclass, fields
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

from motorcade.car.board import make_levels
from motorcade.errors import Sentences, ToldError
from motorcade.words.infrared import air_us

_MOST = (1 << 20) - 1
_SENTENCES: Sentences = {
    "no-profile": {
        "en": "there is no profile '{name}'; built in: {known}",
        "zh": "没有车型 '{name}'；内置车型：{known}",
    },
    "unreadable": {
        "en": "the profile {name} can't be read: {reason}",
        "zh": "无法读取车型文件 {name}：{reason}",
    },
    "no-toml": {
        "en": "the profile {name} is not TOML: {reason}",
        "zh": "车型文件 {name} 不是 TOML：{reason}",
    },
    "no-table": {
        "en": "profile {name}: {key} is a table of its own: [{key}]",
        "zh": "车型文件 {name}：{key} 应是单独的表：[{key}]",
    },
    "unknown-key": {
        "en": "profile {name}: '{key}' is not known; known are {known}",
        "zh": "车型文件 {name}：没有 '{key}' 这一项；可用的有 {known}",
    },
    "missing-key": {
        "en": "profile {name}: '{key}' is missing",
        "zh": "车型文件 {name}：缺少 '{key}'",
    },
    "no-number": {
        "en": "profile {name}: {key} is {value}; allowed: whole numbers from 1 to {most}",
        "zh": "车型文件 {name}：{key} 是 {value}；应为 1 到 {most} 的整数",
    },
    "no-levels": {
        "en": "profile {name}: {key} is {value}; allowed: a list of {count} whole numbers",
        "zh": "车型文件 {name}：{key} 是 {value}；应为 {count} 个整数的列表",
    },
    "level-0": {
        "en": "profile {name}: {key} starts with {value}; level 0 is always 0",
        "zh": "车型文件 {name}：{key} 的第一个值是 {value}；0 档必须是 0",
    },
    "not-rising": {
        "en": "profile {name}: {key} is {value}; each level must be above the one before",
        "zh": "车型文件 {name}：{key} 是 {value}；每一档都应高于前一档",
    },
    "relay-period": {
        "en": "profile {name}: infrared.relay_period_ms is {period_ms}; it must be longer than a frame and its gap, "
        "{longest_ms:g} ms",
        "zh": "车型文件 {name}：infrared.relay_period_ms 是 {period_ms}；"
        "它应大于一帧及其间隔的时间 {longest_ms:g} 毫秒",
    },
    "drive-times": {
        "en": "profile {name}: drive.watchdog_ms is {watchdog_ms}, failsafe_ms {failsafe_ms} and hand_over_ms "
        "{hand_over_ms}; each must be shorter than the one behind it",
        "zh": "车型文件 {name}：drive.watchdog_ms 是 {watchdog_ms}，failsafe_ms 是 {failsafe_ms}，hand_over_ms 是 "
        "{hand_over_ms}；三者应依次增大",
    },
}
_NO_TEXT = {"en": "its name or its text can't be", "zh": "文件名或内容无效"}


class ProfileError(ToldError, ValueError):
    """A profile that isn't there, isn't TOML or can't be."""

    SENTENCES = _SENTENCES


@dataclass(frozen=True, slots=True)
class Infrared:
    """Range of a frame, its unit, and the pauses between frames."""

    range_mm: int
    unit_us: int
    gap_ms: int
    relay_period_ms: int
    sense_ms: int


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
class Servo:
    """The steering servo's period and pulse widths, and how far it turns the front wheels at 0 and 180 degrees."""

    period_ms: int
    pulse_0_deg_us: int
    pulse_90_deg_us: int
    pulse_180_deg_us: int
    steering_deg: int


@dataclass(frozen=True, slots=True)
class Motor:
    """The drive motor's largest PWM duty."""

    pwm_max: int


@dataclass(frozen=True, slots=True)
class DriveLimits:
    """What a car that is steered over a network puts up with."""

    failsafe_ms: int
    watchdog_ms: int
    hand_over_ms: int
    commands_per_s: int


@dataclass(frozen=True, slots=True)
class Profile:
    """One kind of car. Each tuple is indexed by the level that stands in a word."""

    name: str
    durations_ms: tuple[int, ...]
    dwell_ms: tuple[int, ...]
    speeds_mm_s: tuple[int, ...]
    turn_rates_deg_s: tuple[int, ...]
    avoid_radii_mm: tuple[int, ...]
    idle_state_ms: int
    infrared: Infrared
    serial: Serial
    body: Body
    servo: Servo
    motor: Motor
    drive: DriveLimits


_LISTS = {"durations_ms": 4, "dwell_ms": 8, "speeds_mm_s": 4, "turn_rates_deg_s": 4, "avoid_radii_mm": 4}
# The profile's parts, by their names.
TABLES: dict[str, type[Any]] = {
    "infrared": Infrared,
    "serial": Serial,
    "body": Body,
    "servo": Servo,
    "motor": Motor,
    "drive": DriveLimits,
}
_START_AT_ZERO = ("durations_ms", "speeds_mm_s", "turn_rates_deg_s")


def levels_of(profile: Profile) -> tuple[int, ...]:
    """The profile's integers as `motorcade.car.brain` takes them in ``levels``."""
    infrared = profile.infrared
    return make_levels(
        profile.durations_ms,
        profile.dwell_ms,
        profile.avoid_radii_mm,
        profile.idle_state_ms,
        infrared.unit_us,
        infrared.gap_ms,
        infrared.relay_period_ms,
        infrared.sense_ms,
    )


@lru_cache(maxsize=32)
def built_in_profile(name: str) -> Profile:
    """The built-in profile called ``name``. Raises ProfileError that lists those there are."""
    if name not in built_in_profiles():
        raise ProfileError("no-profile", name=name[:40], known=", ".join(built_in_profiles()))
    file = resources.files("motorcade") / "profiles" / f"{name}.toml"
    return parse_profile(file.read_text(encoding="utf-8"), name)


def built_in_profiles() -> list[str]:
    """The names of the profiles that come with Motorcade."""
    files = (resources.files("motorcade") / "profiles").iterdir()
    return sorted(file.name.removesuffix(".toml") for file in files if file.name.endswith(".toml"))


def load_profile(name: str, folder: Path = Path()) -> Profile:
    """The profile that a project in ``folder`` names: a built-in one, or a ``.toml`` file there.

    Raises:
        ProfileError: it isn't there or isn't valid.
    """
    if not name.endswith(".toml"):
        return built_in_profile(name)
    try:
        text = (folder / name).read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or _NO_TEXT
        raise ProfileError("unreadable", name=repr(name[:40]), reason=reason) from None
    return parse_profile(text, name)


def parse_profile(text: str, name: str) -> Profile:
    """The Profile in TOML ``text``. Raises ProfileError that names the key at fault."""
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ProfileError("no-toml", name=name, reason=error) from None
    _check_keys(table, {*_LISTS, *TABLES, "idle_state_ms"}, name)
    values: dict[str, Any] = {key: _levels(table, key, count, name) for key, count in _LISTS.items()}
    values["idle_state_ms"] = _whole(table["idle_state_ms"], "idle_state_ms", name)
    for key, kind in TABLES.items():
        part = table[key]
        if not isinstance(part, dict):
            raise ProfileError("no-table", name=name, key=key)
        _check_keys(part, {each.name for each in fields(kind)}, f"{name}, [{key}]")
        values[key] = kind(**{entry: _whole(value, f"{key}.{entry}", name) for entry, value in part.items()})
    profile = Profile(name=name, **values)
    _check_relay(profile)
    _check_drive(profile)
    return profile


def _check_keys(table: dict[str, Any], expected: set[str], name: str) -> None:
    if unknown := sorted(set(table) - expected):
        raise ProfileError("unknown-key", name=name, key=unknown[0], known=", ".join(sorted(expected)))
    if missing := sorted(expected - set(table)):
        raise ProfileError("missing-key", name=name, key=missing[0])


def _whole(value: object, key: str, name: str) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 0 < value <= _MOST:
        raise ProfileError("no-number", name=name, key=key, value=repr(value), most=_MOST)
    return value


def _levels(table: dict[str, Any], key: str, count: int, name: str) -> tuple[int, ...]:
    values = table[key]
    if not isinstance(values, list) or len(values) != count:
        raise ProfileError("no-levels", name=name, key=key, value=repr(values), count=count)
    if key in _START_AT_ZERO:
        if type(values[0]) is not int or values[0] != 0:
            raise ProfileError("level-0", name=name, key=key, value=repr(values[0]))
        levels = (0, *(_whole(value, key, name) for value in values[1:]))
    else:
        levels = tuple(_whole(value, key, name) for value in values)
    if list(levels) != sorted(set(levels)):
        raise ProfileError("not-rising", name=name, key=key, value=values)
    return levels


def _check_relay(profile: Profile) -> None:
    infrared = profile.infrared
    longest_ms = air_us(0xFFFFFFFF, infrared.unit_us) / 1000 + infrared.gap_ms
    if infrared.relay_period_ms <= longest_ms:
        raise ProfileError("relay-period", name=profile.name, period_ms=infrared.relay_period_ms, longest_ms=longest_ms)


def _check_drive(profile: Profile) -> None:
    drive = profile.drive
    if not drive.watchdog_ms < drive.failsafe_ms < drive.hand_over_ms:
        raise ProfileError(
            "drive-times",
            name=profile.name,
            watchdog_ms=drive.watchdog_ms,
            failsafe_ms=drive.failsafe_ms,
            hand_over_ms=drive.hand_over_ms,
        )
