"""Keys that were revoked: who is connected is hung up, who comes is refused, and nobody else notices; by real TLS."""

import re
import socket
import struct
from contextlib import suppress
from datetime import UTC, datetime

import pytest

from motorcade.drive.certificates import CarKeys, list_keys, make_keys, revoke_drivers
from motorcade.drive.keys import RevokedKeys, client_context, read_revoked, server_context
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
    revoked = RevokedKeys(folder / "revoked.txt", is_expected=False)
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
        revoke_drivers(folder, ["lin"])
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


def test_the_list_is_there_when_the_car_starts_and_new_keys_of_that_name_are_taken(folder):
    lost = folder / "lost.pem"
    lost.write_bytes((folder / "driver-lin.pem").read_bytes())
    revoke_drivers(folder, ["lin"])
    assert not (folder / "driver-lin.pem").exists()
    make_keys(folder, [], ["lin"], NOW)
    keys = folder / "car-ada.pem"
    with DrivenCar(
        server_context(keys), profile=PATIENT, revoked=RevokedKeys(folder / "revoked.txt", is_expected=False)
    ) as car:
        with suppress(OSError), opened(lost, car.telemetry_port) as line:
            assert not line.recv(1)
        with opened(folder / "driver-lin.pem", car.telemetry_port) as line:
            assert line.recv(1)
    listed = [(each.name, each.is_revoked) for each in list_keys(folder)]
    assert listed == [("ada", False), ("lin", True), ("mei", False), ("lin", False)]


def test_a_list_that_is_damaged_or_gone_keeps_what_it_had(folder):
    file = revoke_drivers(folder, ["lin"])
    (lin,) = (each.number for each in list_keys(folder) if each.is_revoked)
    whole = file.read_bytes()
    revoked = RevokedKeys(file)
    for damage, says in (
        (lambda: file.write_bytes(b"# all is well\nno number\n"), "line 2 is no serial number"),
        (file.unlink, "can't be read"),
    ):
        damage()
        assert revoked.reload()
        assert says in str(revoked.problem)
        assert not revoked.reload()
        assert lin in revoked
    file.write_bytes(whole)
    assert revoked.reload()
    assert revoked.problem is None
    assert lin in revoked


def test_a_list_that_has_not_changed_is_not_read_for_each_command(folder, monkeypatch):
    reads = []
    revoked = RevokedKeys(revoke_drivers(folder, ["lin"]))
    monkeypatch.setattr("motorcade.drive.keys.read_revoked", reads.append)
    for _ in range(9):
        assert not revoked.reload()
    assert reads == []


@pytest.mark.parametrize("list_keys_of", [("lin",), ("lin", "mei")])
def test_a_list_that_was_cut_or_emptied_lets_nobody_in(folder, list_keys_of):
    """Wherever it was cut, when the car starts; where it ran before, it keeps what it had."""
    numbers = [each.number for each in list_keys(folder) if each.name in ("lin", "mei")]
    for name in list_keys_of:
        revoke_drivers(folder, [name])
    file = folder / "revoked.txt"
    whole = file.read_bytes()
    for length in range(len(whole)):
        file.write_bytes(whole[:length])
        revoked = RevokedKeys(file, is_expected=False)
        # Without the last end of line it is whole.
        assert (revoked.problem is None) == (length == len(whole) - 1), length
        assert [number in revoked for number in numbers] == (
            [True] * 2 if revoked.problem else [name in list_keys_of for name in ("lin", "mei")]
        )
    file.unlink()
    file.mkdir()
    assert numbers[0] in RevokedKeys(file, is_expected=False)


def test_of_a_cut_list_of_what_was_issued_nothing_is_revoked(folder):
    """A driver may have had several keys: those that were cut off would stay valid."""
    file = folder / "issued.pem"
    whole = file.read_bytes()
    for length in (0, 10, whole.index(b"-----BEGIN", 20), len(whole) - 2):
        file.write_bytes(whole[:length])
        for act in (lambda: list_keys(folder), lambda: revoke_drivers(folder, ["lin"])):
            with pytest.raises(MotorcadeError, match="cut or changed"):
                act()


def test_a_car_whose_list_can_not_be_read_says_so(folder):
    file = folder / "revoked.txt"
    assert RevokedKeys(file, is_expected=False).problem is None
    with DrivenCar(profile=PATIENT, revoked=RevokedKeys(file)) as car:
        wait_until(lambda: "revoked.txt can't be read" in car.control.telemetry().last_fault)
        file.write_bytes(b"\xff")
        wait_until(lambda: "text" in car.control.telemetry().last_fault)


def test_a_list_is_a_text_that_its_owner_may_edit(folder):
    file = folder / "mine.txt"
    text = "# lost at the fair\n\n4A3f  # lin\n  10\n"
    file.write_text(text, encoding="utf-8")
    # The sentence has the line that makes it whole.
    with pytest.raises(MotorcadeError, match="last line") as refused:
        read_revoked(file)
    (last,) = re.findall("'(#.*)'", str(refused.value))
    for newline in ("\n", "\r\n"):
        file.write_bytes((text + last).replace("\n", newline).encode())
        assert read_revoked(file) == {0x4A3F, 0x10}
    file.write_text(f"{text}11\n{last}", encoding="utf-8")
    with pytest.raises(MotorcadeError, match="5 lines"):
        read_revoked(file)
    (mei,) = (each.number for each in list_keys(folder) if each.name == "mei")
    assert read_revoked(revoke_drivers(folder, [f"{mei:x}"])) == {mei}


def test_nobody_is_revoked_by_a_wrong_name_or_twice(folder):
    for name in ("eve", "ada"):
        with pytest.raises(MotorcadeError, match=f"driver {name}"):
            revoke_drivers(folder, ["lin", name])
    assert not (folder / "revoked.txt").exists()
    revoke_drivers(folder, ["lin"])
    with pytest.raises(MotorcadeError, match="driver lin"):
        revoke_drivers(folder, ["lin"])
    revoke_drivers(folder, ["mei"])
    assert [each.is_revoked for each in list_keys(folder)] == [False, True, True]
