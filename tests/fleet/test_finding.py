"""Cars that announce themselves by real multicast DNS at the loopback interface, and cars of a list."""

import asyncio
from datetime import UTC, datetime

import pytest

from motorcade.drive.certificates import CarKeys, make_keys
from motorcade.drive.keys import client_context, name_in, server_context
from motorcade.errors import MotorcadeError
from motorcade.fleet.cars import Cars, Finder
from motorcade.fleet.places import CAR, STUDIO, announced, read_list
from support.rooms import simulated_cars
from support.waiting import until


@pytest.mark.parametrize(
    ("named", "folder", "problem"), [("", "", None), ("bo", "", None), ("ada", "x", "car-keys-refused")]
)
def test_an_announced_car_has_to_have_keys_of_the_authority_whatever_is_announced_of_them(
    named, folder, problem, tmp_path
):
    """A router gives it another address each day, and the announcement is maybe a stranger's."""
    for place in {tmp_path, tmp_path / folder}:
        make_keys(place, [CarKeys("ada")], ["bea"], datetime.now(UTC))
    keys = tmp_path / folder / "car-ada.pem"

    with simulated_cars(1, tls=server_context(keys)) as made:
        listener = ("127.0.0.1", int(made[0].address.rpartition(":")[2]))

        async def test():
            async with (
                Cars(tls=client_context(tmp_path / "driver-bea.pem")) as cars,
                Finder(cars).looking(["127.0.0.1"]),
            ):
                known = lambda each: each.where == made[0].address and (each.problem or not each.away)  # noqa: E731
                (status,) = await until(lambda: list(filter(known, cars.statuses())))
                return status.problem and status.problem.code

        with announced(CAR, "", listener, on_loopback=True, keys=named or name_in(keys)):
            assert asyncio.run(test()) == problem


def test_announced_cars_and_studios_are_found():
    """Real multicast DNS at the loopback interface."""

    async def test():
        async with Cars() as cars, (finder := Finder(cars)).looking(["127.0.0.1"]):
            # Other tests may announce cars meanwhile.
            await until(lambda: "ada" in [each.name for each in cars.statuses() if not each.away])
            await until(lambda: "<i>" in [each.name for each in finder.others.values()])

    problems = []
    with simulated_cars(1, name="ada") as made:
        port = int(made[0].address.rpartition(":")[2])
        with (
            announced(CAR, "ada", ("127.0.0.1", port), problems.append, on_loopback=True),
            announced(STUDIO, "<i>", ("127.0.0.1", 9), problems.append, on_loopback=True),
        ):
            asyncio.run(test())
    assert problems == []


def test_a_car_that_can_not_announce_itself_runs_on_and_says_so(monkeypatch):
    def refuses(**_):
        raise OSError("no multicast here")

    problems = []
    monkeypatch.setattr("zeroconf.Zeroconf", refuses)
    with announced(CAR, "ada", ("127.0.0.1", 9), problems.append, on_loopback=True):
        pass
    assert [problem.code for problem in problems] == ["not-announced"]
    assert "no multicast here" in problems[0].sentence("en")


@pytest.mark.parametrize("host", ["127.0.0.1", "127.3.2.1", "::1"])
def test_what_only_this_computer_reaches_is_announced_to_nobody(monkeypatch, host):
    asked = []
    monkeypatch.setattr("zeroconf.Zeroconf", lambda **options: asked.append(options))
    with announced(CAR, "ada", (host, 9), asked.append):
        pass
    assert asked == []


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("ada = 7001", "ada has to be text"),
        ('ada = "192.168.1.20:7001"\nbo = "192.168.1.20:7001"', "twice"),
        ('ada = "socket://:0"', "HOST:PORT"),
        ('ada = "drive://x:99999"', "HOST:PORT"),
        ('ada = ""', "port"),
        ("ada", "TOML"),
    ],
)
def test_a_list_with_a_mistake_is_refused_in_a_sentence(tmp_path, text, sentence):
    (tmp_path / "cars.toml").write_text(text, encoding="utf-8")
    with pytest.raises(MotorcadeError, match=sentence):
        read_list(tmp_path / "cars.toml")


def test_a_list_has_ports_addresses_and_drive_servers(tmp_path):
    text = (
        '"阿达" = "/dev/ttyUSB0"\nbo = "car.local:7001"\nd = "drive://10.0.0.7"\n"e\\u202e" = "COM3"\nf = "[fe80::1]:9"'
    )
    (tmp_path / "cars.toml").write_text(text, encoding="utf-8")
    found = read_list(tmp_path / "cars.toml")
    assert [(each.name, each.address, each.kind) for each in found] == [
        ("阿达", "/dev/ttyUSB0", "car"),
        ("bo", "car.local:7001", "car"),
        ("d", "drive://10.0.0.7:5005", "drive"),
        ("e", "COM3", "car"),
        ("f", "[fe80::1]:9", "car"),
    ]
    assert (found[2].telemetry_port, found[4].host) == (5006, "fe80::1")
