"""Keys that were revoked: who is connected is hung up, who comes is refused, and nobody else notices; by real TLS."""

import os
import socket
import struct
from contextlib import suppress
from datetime import UTC, datetime

import pytest

from motorcade.drive.blocking_client import BlockingDriveClient
from motorcade.drive.tls.certificates import CarKeys, make_keys
from motorcade.drive.tls.keys import client_context, server_context
from motorcade.drive.tls.revocation import list_keys, revoke_drivers
from motorcade.drive.tls.revoked import RevokedKeys
from motorcade.errors import MotorcadeError
from motorcade.words.formats import DRIVE
from support.driven_car import PATIENT, DrivenCar
from support.waiting import DEADLINE_S, wait_until

NOW = datetime.now(UTC)
ARM = struct.pack(">I", DRIVE.encode(angle=90, direction=1, speed=0))
MOVE = struct.pack(">I", DRIVE.encode(angle=90, direction=1, speed=99))


@pytest.fixture
def folder(tmp_path):
    make_keys(tmp_path, [CarKeys("ada")], ["lin", "mei"], NOW)
    return tmp_path


def opened(keys, port):
    plain = socket.create_connection(("127.0.0.1", port), DEADLINE_S)
    return client_context(keys).wrap_socket(plain, server_hostname="ada")


def test_a_driver_whose_keys_are_revoked_is_hung_up_and_the_wheels_stand_still(folder):
    keys = folder / "car-ada.pem"
    # Somebody who has lost a file may still have a copy.
    copy = folder / "copy.pem"
    copy.write_bytes((folder / "driver-lin.pem").read_bytes())
    revoked = RevokedKeys(folder / "revoked.crl", keys)
    with (
        DrivenCar(server_context(keys), profile=PATIENT, revoked=revoked) as car,
        opened(copy, car.port) as lin,
        opened(folder / "driver-mei.pem", car.port) as mei,
    ):
        wait_until(lambda: len(car.server.commands) == 2)
        lin.sendall(ARM)
        wait_until(lambda: car.control.telemetry().driver)
        lin.sendall(MOVE)
        wait_until(car.board.has_moved)
        revoke_drivers(folder, ["lin"], NOW)
        assert not lin.recv(1)
        wait_until(lambda: not car.board.moves)
        wait_until(lambda: [each.client for each in car.server.commands] == ["mei"])
        told = len(car.board.notes)
        for _ in range(5):
            # The command travels together with the end of the handshake.
            with suppress(OSError), opened(copy, car.port) as again:
                again.sendall(ARM + MOVE)
                assert not again.recv(1)
        assert not car.board.has_moved(told)
        mei.sendall(ARM)
        wait_until(lambda: car.control.telemetry().driver)
        mei.sendall(MOVE)
        wait_until(lambda: car.board.moves)


def client_of(car, keys):
    return BlockingDriveClient("127.0.0.1", car.port, telemetry_port=car.telemetry_port, keys=keys, car="ada")


def test_the_list_is_there_when_the_car_starts_and_new_keys_of_that_name_are_taken(folder):
    lost = folder / "lost.pem"
    lost.write_bytes((folder / "driver-lin.pem").read_bytes())
    revoke_drivers(folder, ["lin"], NOW)
    assert not (folder / "driver-lin.pem").exists()
    make_keys(folder, [], ["lin"], NOW)
    keys = folder / "car-ada.pem"
    with DrivenCar(server_context(keys), profile=PATIENT, revoked=RevokedKeys(folder / "revoked.crl", keys)) as car:
        with suppress(OSError), opened(lost, car.telemetry_port) as line:
            assert not line.recv(1)
        with client_of(car, folder / "driver-lin.pem") as client:
            assert client.next_telemetry().state
    listed = [(each.name, each.is_revoked) for each in list_keys(folder)]
    assert listed == [("ada", False), ("lin", True), ("mei", False), ("lin", False)]


def test_a_list_that_is_damaged_or_of_somebody_else_changes_nothing_while_a_car_runs(folder, tmp_path):
    revoke_drivers(folder, ["lin"], NOW)
    file, problems = folder / "revoked.crl", []
    (lin,) = (each.number for each in list_keys(folder) if each.is_revoked)
    revoked = RevokedKeys(file, folder / "car-ada.pem", problems.append)
    make_keys(tmp_path / "others", [], ["eve"], NOW)
    foreign = revoke_drivers(tmp_path / "others", ["eve"], NOW).read_bytes()
    for at, data in enumerate((b"", b"nonsense", foreign), 1):
        file.write_bytes(data)
        os.utime(file, ns=(at, at))
        assert not revoked.reload()
        assert lin in revoked
        with pytest.raises(MotorcadeError, match=r"is no list of revoked keys"):
            RevokedKeys(file, folder / "car-ada.pem")
    file.unlink()
    assert not revoked.reload()
    assert lin in revoked
    assert [each.code for each in problems] == ["revoked-keys-unreadable"] * 3


def test_nobody_is_revoked_by_a_wrong_name_or_twice(folder):
    for name in ("eve", "ada"):
        with pytest.raises(MotorcadeError, match=f"driver {name}"):
            revoke_drivers(folder, ["lin", name], NOW)
    assert not (folder / "revoked.crl").exists()
    revoke_drivers(folder, ["lin"], NOW)
    with pytest.raises(MotorcadeError, match="driver lin"):
        revoke_drivers(folder, ["lin"], NOW)
    revoke_drivers(folder, ["mei"], NOW)
    assert [each.is_revoked for each in list_keys(folder)] == [False, True, True]
