"""The moves by which a car is measured, as images; what was read of them; and cars that drive as one that was."""

from msgspec import Struct, structs

from motorcade.config.calibration import (
    MOVES,
    CalibrationMove,
    check_readings,
    fit,
    measured_profile,
    profile_text,
    readings_of,
    told,
    with_figures,
)
from motorcade.config.profile import Profile, built_in_profile
from motorcade.program.compiler import compile_program
from motorcade.program.flow_steps import forever
from motorcade.program.model import Program
from motorcade.program.steps import DriveStep, LedStep, WaitStep
from motorcade.service.messages import MeasuredCar, Sentence, sentences

# Time to unplug the car and to step back; then its lamp says that it is about to drive.
UNPLUG_S = 9
LAMP_S = 3
# What the profile's file is called until its user names it.
_FILE = "my_car.toml"


class CarMove(Struct):
    """A move of a car that is measured: its key, its title, whether an angle is read, and the image that makes it."""

    key: str
    title: Sentence
    turns: bool
    image: bytes


class CarReadings(Struct):
    """What was read after moves, by their keys, as `readings_of` takes it: "88.5 3"; nothing for "".

    ``profile`` is the car's kind so far.
    """

    readings: dict[str, str]
    profile: str = "classroom"


class CarFigures(Struct):
    """What the readings say of the car; no car and no text until each move has one.

    Attributes:
        told: a sentence for each figure.
        car: the figures.
        text: the car's profile as a file.
    """

    told: list[Sentence] = []
    car: MeasuredCar | None = None
    text: str = ""


def move_image(move: CalibrationMove, profile: Profile) -> bytes:
    """Return the image of a car that makes a move once, after UNPLUG_S and LAMP_S, and again after each reset.

    Raises MotorcadeError where the profile has no such times.
    """
    steps = [
        WaitStep(UNPLUG_S),
        LedStep(which=0, seconds=LAMP_S),
        DriveStep(move.direction, move.level, move.seconds),
        forever(WaitStep(1)),
    ]
    return compile_program(Program(steps, profile=profile.name), profile).image


def list_moves(profile: str = "classroom") -> list[CarMove]:
    """Return the moves. Raises MotorcadeError."""
    kind = built_in_profile(profile)
    return [CarMove(move.key, sentences(move.title), move.turns, move_image(move, kind)) for move in MOVES]


def fit_readings(sent: CarReadings) -> CarFigures:
    """Return what the readings say. Raises MotorcadeError where no car can have done that, or it is no reading."""
    readings = {
        move.key: readings_of(move, text) for move in MOVES if (text := sent.readings.get(move.key, "").strip())
    }
    check_readings(readings)
    if len(readings) < len(MOVES):
        return CarFigures()
    found = fit(readings)
    profile = measured_profile(found, built_in_profile(sent.profile), _FILE)
    wheels = profile.wheels
    car = MeasuredCar(
        list(profile.speeds_mm_s), list(profile.turn_rates_deg_s), wheels.drift_mrad_per_m, wheels.stopping_ms
    )
    return CarFigures(list(map(sentences, told(found))), car, profile_text(profile))


def driven_as(profile: Profile, car: MeasuredCar | None) -> Profile:
    """Return ``profile`` with the figures of a car that was measured. Raises MotorcadeError where one can't be."""
    if car is None:
        return profile
    figures = structs.asdict(car)
    wheels = {key: figures.pop(key) for key in ("drift_mrad_per_m", "stopping_ms")}
    return with_figures(profile, profile.name, **figures, wheels=wheels)
