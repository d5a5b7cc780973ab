"""A car is measured at a terminal: `motorcade calibrate`."""

import getpass
import json
import signal
import sys
from unittest.mock import Mock

import pytest

from motorcade import load_profile
from motorcade.upload import serial_port
from support.command_line import data, refusal, run
from support.terminal_process import terminal

# Six moves: the second is answered badly first, the fourth goes back to the third.
ANSWERS = ["30 0", "far", "29", "60 1", "89", "-", "88 4; 88 4", "30 0.5", "262", "266"]


def typed(answers):
    return "".join(f"{answer}\n" for answer in answers)


def test_a_pupil_measures_a_car_and_gets_its_profile(tmp_path):
    profile = tmp_path / "mine.toml"
    ran = run("calibrate", "--no-upload", "-o", profile, typed=typed(ANSWERS))
    assert ran.code == 0, ran.err
    assert "'far' is no way" in ran.err
    assert "went no farther than in the move" in ran.err
    assert "Move 6 of 6: turn right for 3 s" in ran.err
    assert "Turn rates of levels 1 to 3: 2" in ran.out
    measured = load_profile("mine.toml", tmp_path)
    assert measured.turn_rates_deg_s[3] == 88
    assert measured.wheels.drift_mrad_per_m > 50
    assert measured.durations_ms == load_profile("classroom").durations_ms


def test_each_move_is_sent_to_the_car_before_it_is_asked_for(tmp_path, monkeypatch):
    sent = []
    monkeypatch.setattr(serial_port, "upload", lambda port, image, baud, **_: sent.append((port, image, baud)))
    answers = [answer for answer in ANSWERS if answer not in ("far", "29", "-", "89")]
    ran = run("--json", "calibrate", "-p", "COM3", "-o", tmp_path / "mine.toml", typed=typed(answers))
    assert json.loads(ran.out)["turn_rates_deg_s"][2][0] == 88
    assert [port for port, _, _ in sent] == ["COM3"] * 6
    assert len({image for _, image, _ in sent}) == 6


def test_whoever_stops_answering_gets_no_profile(tmp_path):
    profile = tmp_path / "mine.toml"
    assert run("calibrate", "--no-upload", "-o", profile, typed=typed(ANSWERS[:4])).code == 130
    assert not profile.exists()


def test_what_can_be_no_profile_is_refused_before_anybody_measures(tmp_path):
    assert "has to end with .toml" in refusal(2, "calibrate", "--no-upload", "-o", tmp_path / "mine.profile")
    assert "no such file or folder" in refusal(2, "calibrate", "--no-upload", "-o", tmp_path / "nowhere" / "mine.toml")


def test_a_file_of_answers_that_ends_too_early_is_told(tmp_path):
    ran = run("calibrate", "--no-upload", "-o", tmp_path / "mine.toml")
    assert ran.code == 2
    assert "slowly ahead for 3 s': nothing is measured yet" in ran.err


def test_cars_of_a_project_drive_as_the_one_that_it_keeps(tmp_path):
    project = tmp_path / "mine.motorcade.json"
    leader = [{"drive": {"direction": "forward", "speed": 1, "seconds": 1}}, {"wait": {"seconds": 3}}]
    document = {"format": "motorcade-program/1", "profile": "classroom", "leader": leader, "followers": None}
    figures = {"speeds_mm_s": [0, 50, 200, 300], "turn_rates_deg_s": [0, 30, 60, 90]}
    car = {**figures, "drift_mrad_per_m": 0, "stopping_ms": 0}
    ways = []
    for view in ({}, {"car": car}, {"car": {**car, "stopping_ms": 500}}, {"car": {"speeds_mm_s": "fast"}}):
        project.write_text(json.dumps({**document, "view": view}), encoding="utf-8")
        first, last = (data("simulate", project, "--seconds", seconds)["cars"][0]["x"] for seconds in (0.01, 3))
        ways.append(round(last - first, 2))
    assert ways == [0.1, 0.05, 0.07, 0.1]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")
def test_ctrl_c_at_a_question_ends_as_anywhere_else(tmp_path):
    """1 would say that a program has errors. What was typed before it need not be text."""
    with terminal("calibrate", "-o", tmp_path / "car.toml", "--no-upload") as user:
        user.wait_for("cm ahead")
        user.type(b"\xff\n")
        user.wait_for("is no way")
        user.process.send_signal(signal.SIGINT)
        user.wait(lambda: user.process.poll() is not None)
        assert user.process.returncode == 130


@pytest.mark.parametrize(
    ("problem", "code", "says"),
    [(KeyboardInterrupt(), 130, ""), (UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid"), 2, "is no text")],
)
def test_a_password_that_is_broken_off_or_no_text_ends_in_order(monkeypatch, problem, code, says):
    monkeypatch.setattr(getpass, "getpass", Mock(side_effect=problem))
    options = ("--chip", "esp32", "--wifi", "school", "--insecure-lan", "--port", "/dev/nowhere")
    ran = run("install-firmware", *options)
    assert (ran.code, says in ran.err) == (code, True)
