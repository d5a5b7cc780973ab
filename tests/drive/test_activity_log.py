"""Who drove, stopped and cleared: what the log says, its size, and disks that are full or hang."""

import json
import os
import sys
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path

import pytest

from motorcade.drive import activity_log
from motorcade.drive.activity_log import MOST_BYTES, OLD_FILES, ActivityLog
from motorcade.drive.session import ControlSession
from motorcade.errors import MotorcadeError
from motorcade.words.formats import DRIVE
from support.socketless_car import SocketlessCar
from support.waiting import wait_until

AT = datetime(2026, 11, 22, 23, 30, tzinfo=UTC)
STILL = DRIVE.encode(angle=90, direction=1, speed=0)


def entries(file):
    return [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]


def test_it_says_who_drove_stopped_and_cleared(tmp_path):
    log, car = ActivityLog(tmp_path / "log.jsonl", lambda problem: None), SocketlessCar()
    car.control.record = partial(log.record, car="ada")
    lin, mei = (ControlSession(car.control, name) for name in ("lin:1", "小美:2"))
    lin.command(STILL)
    mei.stop()
    mei.stop()
    mei.clear()
    lin.leave()
    log.close()
    told = entries(tmp_path / "log.jsonl")
    assert [(each["car"], each["did"], each["who"]) for each in told] == [
        ("ada", "drives", "lin:1"),
        ("ada", "stops", "小美:2"),
        ("ada", "clears", "小美:2"),
        ("ada", "ends", "lin:1"),
        ("ada", "stops", "小美:2"),
    ]
    assert [each.get("more") for each in told] == [None, None, None, None, 1]
    assert all(datetime.fromisoformat(each["at"]).tzinfo for each in told)


def test_it_goes_on_behind_what_is_there_and_takes_bounded_space(tmp_path):
    file = tmp_path / "log.jsonl"
    for who in ("lin", "mei"):
        log = ActivityLog(file, lambda problem: None, lambda: AT)
        log.record("stops", who)
        log.close()
    assert [each["who"] for each in entries(file)] == ["lin", "mei"]
    file.write_bytes(b"x" * (MOST_BYTES - 10))
    for number in range(OLD_FILES + 1):
        (tmp_path / f"log.jsonl.{number + 1}").write_text(str(number))
    log = ActivityLog(file, lambda problem: None, lambda: AT)
    log.record("stops", "l" * 10_000 + "\n")
    log.close()
    (entry,) = entries(file)
    assert len(entry["who"]) == 120
    assert (tmp_path / "log.jsonl.1").stat().st_size == MOST_BYTES - 10
    # The oldest has made room; a file that this log never wrote stays.
    assert [(tmp_path / f"log.jsonl.{number}").read_text() for number in (2, 3, 4, 5)] == ["0", "1", "2", "4"]


def test_a_flood_of_stops_is_counted_and_pushes_nobody_out(tmp_path):
    """220 stops a second of one client, of new connections and other names too, for ten minutes."""
    now = [AT]
    log = ActivityLog(
        tmp_path / "log.jsonl", lambda problem: None, lambda: now[0], lambda: (now[0] - AT).total_seconds()
    )
    log.record("drives", "lin:1", "ada")
    for second in range(600):
        now[0] = AT + timedelta(seconds=second)
        for number in range(220):
            log.record("stops", f"name {number} · 192.168.1.7:{number}", "ada")
    log.record("stops", "mei:1", "ada")
    log.close()
    told = entries(tmp_path / "log.jsonl")
    assert not (tmp_path / "log.jsonl.1").exists()
    assert (told[0]["who"], told[1]["who"]) == ("lin:1", "name 0 · 192.168.1.7:0")
    assert (told[2]["more"], told[2]["in_s"]) == (2199, 10)
    assert len(told) < 140
    assert sum(each.get("more", 1) for each in told) == 2 + 600 * 220


@pytest.mark.parametrize("set_by", [timedelta(days=-400), timedelta(days=400), timedelta(seconds=-9)])
def test_a_clock_that_is_set_puts_no_more_and_no_fewer_into_a_line(tmp_path, set_by):
    """As a Raspberry Pi's is, which finds out the time when it has a network."""
    now, since_s = [AT], [0.0]
    log = ActivityLog(tmp_path / "log.jsonl", lambda problem: None, lambda: now[0], lambda: since_s[0])
    for second in range(40):
        since_s[0] = float(second)
        now[0] = AT + timedelta(seconds=second) + (set_by if second >= 5 else timedelta(0))
        log.record("stops", "lin:1")
    log.close()
    assert [each.get("more") for each in entries(tmp_path / "log.jsonl")] == [None, 9, None, 9, None, 9, None, 9]


def test_a_count_is_written_though_nothing_else_happens(tmp_path, monkeypatch):
    monkeypatch.setattr(activity_log, "TOGETHER_S", 0.01)
    now = [AT]
    log = ActivityLog(tmp_path / "log.jsonl", lambda problem: None, lambda: now[0])
    for _ in range(3):
        log.record("stops", "lin:1")
    now[0] = AT + timedelta(seconds=1)
    wait_until(lambda: len(entries(tmp_path / "log.jsonl")) == 2)
    log.close()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
def test_a_full_disk_is_reported_once_and_stops_nothing():
    problems = []
    full = os.open("/dev/full", os.O_WRONLY)
    log = ActivityLog(Path(f"/dev/fd/{full}"), problems.append, lambda: AT)
    for number in range(100):
        log.record("stops", f"lin{number}:1")
    log.close()
    os.close(full)
    (problem,) = problems
    assert problem.code == "log-not-written"
    assert "the disk is full" in str(problem)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pipes among its files")
def test_a_disk_that_hangs_delays_neither_a_stop_nor_the_end_and_what_it_missed_is_counted(monkeypatch):
    monkeypatch.setattr(activity_log, "_LAST_RECORDS_S", 0.01)
    # Nobody reads it, so the writer hangs when the pipe is full.
    reader, writer = os.pipe()
    log = ActivityLog(Path(f"/dev/fd/{writer}"), lambda problem: None, lambda: AT)
    os.close(writer)
    car = SocketlessCar()
    car.control.record = log.record
    ControlSession(car.control, "lin:1").command(STILL)
    for number in range(2000):
        ControlSession(car.control, f"mei{number}:1").stop()
    assert car.control.telemetry().state == "stopped"
    log.close()
    with os.fdopen(reader, encoding="utf-8") as lines:
        counted = [json.loads(line) for line in lines]
    lost = sum(each.get("records", 0) for each in counted)
    assert lost > 0
    assert lost + sum("who" in each for each in counted) == 2001


def test_a_log_that_can_not_be_opened_is_a_sentence(tmp_path):
    with pytest.raises(MotorcadeError, match="can't be written: "):
        ActivityLog(tmp_path / "none" / "log.jsonl", print)
