"""The seed's own client, in C++ as the seed describes it, drives a car."""

import shutil
import struct
import subprocess
import sys
from pathlib import Path

import pytest

from support.driven_car import PATIENT, DrivenCar
from support.waiting import DEADLINE_S, wait_until

COMPILER = shutil.which("g++")
SOURCE = Path(__file__).with_name("seed_client.cpp")
# The seed's worked example; its test program's struct in the order that it has; and every limit.
COMMANDS = ((40, 1, 150), (40, 0, 150), (180, 1, 255), (0, 0, 1), (90, 1, 0))
# The seed's 'int' lies in memory as its processor has it; the car reads the network's order unless it is told.
ORDERS = (("network", "big"), ("native", sys.byteorder))

needs_compiler = pytest.mark.skipif(COMPILER is None, reason="there is no g++ here")


@pytest.fixture(scope="module")
def seed_client(tmp_path_factory):
    program = tmp_path_factory.mktemp("seed") / "seed_client"
    strict = ("-std=c++11", "-Wall", "-Wextra", "-Werror", "-fsanitize=undefined", "-fno-sanitize-recover")
    subprocess.run([COMPILER, *strict, "-o", program, SOURCE], check=True, timeout=120)
    return program


@needs_compiler
@pytest.mark.parametrize(("sends", "served"), ORDERS)
def test_the_seed_s_client_drives_the_car_in_both_byte_orders(seed_client, sends, served):
    with (
        DrivenCar(byte_order=served, profile=PATIENT) as car,
        subprocess.Popen([seed_client, str(car.port), sends], stdin=subprocess.PIPE, text=True) as client,
    ):
        for command in COMMANDS:
            print(*command, file=client.stdin, flush=True)
            wait_until(lambda wanted=command: car.board.setpoint == wanted)
        client.stdin.close()
        assert client.wait(DEADLINE_S) == 0
        wait_until(lambda: car.control.telemetry().driver is None)
        assert car.control.telemetry().refused == 0


@needs_compiler
def test_the_seed_s_client_that_leaves_stops_the_car(seed_client):
    with DrivenCar(profile=PATIENT) as car:
        with subprocess.Popen([seed_client, str(car.port), "network"], stdin=subprocess.PIPE, text=True) as client:
            print(40, 1, 150, file=client.stdin, flush=True)
            wait_until(lambda: car.board.moves)
        wait_until(lambda: not car.board.moves)


@needs_compiler
def test_the_wrong_byte_order_moves_nothing_and_is_counted(seed_client):
    wrong = "little" if sys.byteorder == "big" else "big"
    with (
        DrivenCar(byte_order=wrong, profile=PATIENT) as car,
        subprocess.Popen([seed_client, str(car.port), "native"], stdin=subprocess.PIPE, text=True) as client,
    ):
        # 0x1284B000 and 0x00B08412: code 0 is none.
        assert struct.pack("<I", 310685696)[0] >> 4 != 1
        print(40, 0, 150, file=client.stdin, flush=True)
        wait_until(lambda: car.control.telemetry().refused == 1)
        client.stdin.close()
        assert client.wait(DEADLINE_S) == 0
        assert not any(setpoint[2] for _, setpoint in car.board.notes)
