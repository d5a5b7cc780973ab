"""A page measures a car, and its simulated cars drive as that one does."""

from dataclasses import replace

import pytest
from msgspec import to_builtins

from motorcade.config.calibration import MOVES
from motorcade.config.profile import built_in_profile, parse_profile
from motorcade.errors import MotorcadeError
from motorcade.service.calibration import CarReadings, driven_as, fit_readings, list_moves
from motorcade.service.documents import open_text, opening, project_text
from motorcade.service.messages import MeasuredCar, MissionChoice
from motorcade.service.missions import chosen_mission
from motorcade.service.studio_world import open_world
from motorcade.service.world_messages import SetWorld
from motorcade.words.image import parse_image_bytes

READ = {"slow": "30 1", "medium": "61 3", "fast": "90 7", "short": "31 1", "left": "265", "right": "270"}


def test_the_moves_have_titles_and_images_that_make_them_once():
    moves = list_moves()
    assert [move.key for move in moves] == [move.key for move in MOVES]
    assert moves[4].title == {"en": "turn left for 3 s", "zh": "左转 3 秒"}
    assert len({move.image for move in moves}) == 6
    assert all(parse_image_bytes(move.image).decides for move in moves)


def test_readings_become_a_car_once_each_move_has_one():
    assert fit_readings(CarReadings({"slow": "30 1", "medium": " "})).car is None
    answer = fit_readings(CarReadings(READ))
    profile = driven_as(built_in_profile("classroom"), answer.car)
    assert profile.turn_rates_deg_s == (0, 30, 60, 89)
    assert profile.wheels.drift_mrad_per_m > 100
    assert profile.body == built_in_profile("classroom").body
    assert replace(parse_profile(answer.text, "mine"), name="classroom") == profile
    assert answer.told[1]["en"].startswith("Turn rates of levels 1 to 3: ")


def test_a_reading_that_cannot_be_is_refused_as_soon_as_it_is_known():
    with pytest.raises(MotorcadeError, match="no farther"):
        fit_readings(CarReadings({"slow": "30", "medium": "29"}))
    with pytest.raises(MotorcadeError, match="'wide' is no angle"):
        fit_readings(CarReadings({"left": "wide"}))


def test_a_project_keeps_the_car_that_its_cars_drive_as():
    project = opening()
    project.car = fit_readings(CarReadings(READ)).car
    assert to_builtins(open_text(project_text(project)).car) == to_builtins(project.car)
    assert open_text(project_text(opening())).car is None


def test_a_page_s_cars_drive_as_the_measured_one_but_not_in_a_mission():
    car = fit_readings(CarReadings(READ)).car
    mission = chosen_mission(MissionChoice("forward-and-stop"))
    world = open_world(SetWorld(mission.mat_document, car=car), 100)
    assert world.simulation.profile == driven_as(built_in_profile("classroom"), car)
    with pytest.raises(MotorcadeError, match="how its cars drive"):
        open_world(SetWorld(mission.mat_document, mission=MissionChoice("forward-and-stop"), car=car), 100)
    with pytest.raises(MotorcadeError, match="speeds_mm_s"):
        open_world(SetWorld(mission.mat_document, car=MeasuredCar([0, 9, 8, 7], [0, 1, 2, 3], 0, 0)), 100)
