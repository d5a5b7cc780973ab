"""What strangers announce hides no car from a stop: first, wrongly, much, renewed, withdrawn."""

import asyncio
from contextlib import asynccontextmanager, closing
from random import Random

import pytest
from tests.faults.room_cars import multicast, multicast_of
from zeroconf import DNSOutgoing, ServiceInfo, Zeroconf
from zeroconf.const import _FLAGS_AA, _FLAGS_QR_RESPONSE

from motorcade.drive.client import DriveClient
from motorcade.fleet.cars import MOST_FOUND, Cars, Finder
from motorcade.fleet.found import Turns
from motorcade.fleet.places import CAR, CLASS, DRIVE, SERVICE, network_place, safe_name
from motorcade.words.request import REQUEST_BYTES, STOP, answer_line, read_request
from support.driven_car import DrivenCar
from support.mock_clock import mock_clock, pass_time
from support.rooms import in_loop, server, simulated_cars
from support.waiting import DEADLINE_S, until

HOST = "127.0.0.1"
# A busy machine asks two thousand places for long.
PATIENCE_S = 10 * DEADLINE_S


def found(host, port, kind, telemetry=0):
    return network_place(host, port, "x", kind, telemetry)._replace(found=True)


def as_a_class(port, mute):
    return [found(HOST, port, CLASS)]


def as_a_car(port, mute):
    return [found(HOST, port, CAR)]


def as_drive_servers(port, mute):
    """Their telemetry is said to come from a port that is mute, or closed."""
    return [found(HOST, port, DRIVE, telemetry) for telemetry in (mute, 9, *range(20, 40))]


def much_for_its_host(port, mute):
    return [found(HOST, number, kind) for number in range(1, 65) for kind in (CAR, CLASS, DRIVE)]


def much_for_many_hosts(port, mute):
    return [found(f"127.0.1.{host}", number, CAR) for host in range(1, 34) for number in range(1, 65)]


def more_than_is_kept(port, mute):
    mutes = [found(HOST, mute, CAR)]
    return mutes + [found("127.0.1.1", number, CAR) for number in range(1, MOST_FOUND + 200)]


EVERYTHING = (as_a_class, as_a_car, as_drive_servers, much_for_its_host, much_for_many_hosts, more_than_is_kept)


@asynccontextmanager
async def cars_after(lies, port):
    async with server(b"") as mute, Cars() as cars:
        for place in lies(port, int(mute.rpartition(":")[2])):
            cars.add(place)
        yield cars
        await until(lambda: (cars.problem is None) == (lies is not more_than_is_kept), PATIENCE_S)


@pytest.mark.parametrize("lies", EVERYTHING)
@in_loop
async def test_whatever_is_announced_before_it_a_car_is_stopped(lies):
    with simulated_cars(1) as (car,):
        port = int(car.address.rpartition(":")[2])
        async with cars_after(lies, port) as cars:
            await until(lambda: car.wheels != (0, 0), PATIENCE_S)
            cars.order(STOP)
            if lies not in (as_a_class, as_drive_servers):
                cars.add(found(HOST, port, CAR))
            await until(lambda: car.wheels == (0, 0), PATIENCE_S)
            await until(lambda: [each.state for each in cars.statuses() if not each.away] == ["stopped"], PATIENCE_S)
            assert [each.place.kind for each in cars.named(["car-0"])] == [CAR]


@pytest.mark.parametrize("lies", EVERYTHING)
@in_loop
async def test_whatever_is_announced_before_it_a_drive_server_is_stopped(lies):
    with DrivenCar() as car:
        async with cars_after(lies, car.port) as cars:
            cars.order(STOP)
            cars.add(found(HOST, car.port, DRIVE, car.telemetry_port))
            await until(lambda: car.control.telemetry().state == "stopped", PATIENCE_S)
            await until(lambda: [each.state for each in cars.statuses() if not each.away] == ["stopped"], PATIENCE_S)


@in_loop
async def test_a_drive_server_whose_telemetry_is_not_ours_is_stopped_too(monkeypatch):
    with DrivenCar() as car:
        ours = car.control.telemetry
        monkeypatch.setattr(car.control, "telemetry", lambda: ours()._replace(state="asleep"))
        async with Cars() as cars:
            cars.order(STOP)
            cars.add(found(HOST, car.port, DRIVE, car.telemetry_port))
            await until(lambda: ours().state == "stopped", PATIENCE_S)


@in_loop
async def test_a_drive_server_that_answers_keeps_its_connection_and_a_silent_one_is_asked_anew(monkeypatch):
    begun = []

    def beginning(host, port, **options):
        begun.append(port)
        return DriveClient(host, port, **options)

    monkeypatch.setattr("motorcade.fleet.contact.DriveClient", beginning)
    async with server(b"") as mute, Cars() as cars:
        silent_port = int(mute.rpartition(":")[2])
        with DrivenCar() as car:
            cars.add(found(HOST, car.port, DRIVE, car.telemetry_port))
            cars.add(found(HOST, silent_port, DRIVE, silent_port))
            await until(lambda: begun.count(silent_port) > 1, PATIENCE_S)
            cars.order(STOP)
            await until(lambda: car.control.telemetry().state == "stopped", PATIENCE_S)
            assert begun.count(car.port) == 1


@in_loop
async def test_where_a_drive_server_was_a_car_is_found_and_stopped(monkeypatch):
    # What has answered is left in peace for seconds before it is asked otherwise.
    monkeypatch.setattr("motorcade.fleet.contact.AWAY_S", 0.05)
    monkeypatch.setattr("motorcade.fleet.contact._AGAIN_S", 0.05)
    async with Cars() as cars:
        with DrivenCar() as driven:
            port = driven.port
            cars.add(found(HOST, port, DRIVE, driven.telemetry_port))
            await until(lambda: cars.statuses() and cars.statuses()[0].state == "ready")
        with simulated_cars(1, port=port) as (car,):
            cars.order(STOP)
            await until(lambda: [each.state for each in cars.statuses() if not each.away] == ["stopped"])
            assert car.wheels == (0, 0)


@in_loop
async def test_where_a_car_was_a_drive_server_is_found_and_stopped(monkeypatch):
    monkeypatch.setattr("motorcade.fleet.contact._AGAIN_S", 0.05)
    async with Cars() as cars:
        with simulated_cars(1) as (car,):
            port = int(car.address.rpartition(":")[2])
            cars.add(found(HOST, port, CAR))
            await until(lambda: cars.statuses() and not cars.statuses()[0].away)
        with DrivenCar(port=port) as driven:
            cars.add(found(HOST, port, DRIVE, driven.telemetry_port))
            cars.order(STOP)
            await until(lambda: driven.control.telemetry().state == "stopped")


@pytest.mark.parametrize(("count", "is_whole"), [(64, True), (65, False)])
@mock_clock
async def test_classes_that_are_announced_again_crowd_nobody_out(count, is_whole, monkeypatch):
    monkeypatch.setattr("motorcade.fleet.cars.ports", list)
    numbers = range(1, count + 1)
    records = [(f"{time} {number}.", f"127.0.2.{number}", 7710, CLASS) for time in "ab" for number in numbers]
    with multicast_of(multicast(records, Random(1))):
        async with Cars() as cars, (finder := Finder(cars)).looking():
            await pass_time(5)
            await until(lambda: len(finder.others) == 64)
            # By then each was tried once.
            await pass_time(5)
            await until(lambda: (finder.problem is None) == is_whole)


@mock_clock
async def test_while_announcements_wait_to_be_looked_up_the_list_is_not_whole(monkeypatch):
    """A stranger announces names without addresses; whose car waits behind them isn't listed yet."""
    monkeypatch.setattr("motorcade.fleet.cars.ports", list)
    with multicast_of(multicast([(f"{number}.", "", 7001, CAR) for number in range(200)], Random(1))):
        async with Cars() as cars, (finder := Finder(cars)).looking():
            await pass_time(3)
            assert finder.problem is not None
            assert finder.problem.code == "list-not-whole"
            await pass_time(15)
            assert finder.problem is None


@in_loop
async def test_what_was_announced_and_never_answered_is_named_and_has_no_name_of_its_own():
    """A stranger takes no car's name by an announcement."""
    with simulated_cars(1, name="ada") as (car,):
        async with Cars() as cars:
            cars.add(network_place("127.0.0.2", 9, "ada", CAR)._replace(found=True))
            cars.add(found(HOST, int(car.address.rpartition(":")[2]), CAR))
            await cars.known(30)
            assert [each.place.address for each in cars.named(["ada"])] == [car.address]
            cars.order(STOP)
            assert [each.where for each in await cars.confirmed(0.5)] == ["127.0.0.2:9"]


@in_loop
async def test_so_many_announced_addresses_are_kept_and_no_more():
    async with Cars() as cars:
        for port in range(1, MOST_FOUND + 50):
            cars.add(found("127.0.1.1", port, CAR))
        cars.add(found("127.0.1.2", 7, CAR))
        # Each is asked as a car and as a drive server.
        assert len(cars.contacts) == 2 * MOST_FOUND
        # Who announces most gives its place to another host.
        assert "127.0.1.2:7" in cars.contacts


@in_loop
async def test_who_was_not_asked_yet_gives_no_place_to_who_is_announced_later(monkeypatch):
    """Where each host has one address, the first of them may be a car."""
    monkeypatch.setattr("motorcade.fleet.cars.MOST_FOUND", 3)
    hosts = [f"127.0.1.{number}" for number in range(1, 6)]
    async with Cars() as cars:
        for host in hosts:
            cars.add(found(host, 7, CAR))
        assert {contact.place.host for contact in cars.contacts.values()} == set(hosts[:3])
        assert cars.problem


@mock_clock
async def test_a_car_that_is_away_gives_its_place_to_no_stranger(monkeypatch):
    monkeypatch.setattr("motorcade.fleet.cars.MOST_FOUND", 2)

    async def answer_once(reader, writer):
        with closing(writer):
            request = read_request(await reader.readexactly(REQUEST_BYTES))
            writer.write(answer_line(request, (("name", "ada"),)))
            await writer.drain()

    listener = await asyncio.start_server(answer_once, HOST, 0)
    car = found(HOST, listener.sockets[0].getsockname()[1], CAR)
    async with Cars() as cars:
        async with listener:
            cars.add(car)
            await until(lambda: cars.contacts[car.address].has_answered)
        cars.add(found("127.0.1.1", 9, CAR))
        # Both wait for their next tries.
        await pass_time(20.0)
        cars.add(found("127.0.1.2", 9, CAR))
        assert {contact.place.host for contact in cars.contacts.values()} == {HOST, "127.0.1.2"}


def test_a_strangers_name_is_one_short_line():
    assert safe_name("a\x1b[2J\n\u202e " + "x" * 99) == "a[2J " + "x" * 35


def test_hosts_have_their_turns_one_after_the_other_whoever_announces_most():
    turns = Turns()
    for port in range(3):
        turns.wait("a", f"a:{port}")
    for host in ("b", "c"):
        turns.wait(host, f"{host}:1")
    assert [turns.begin() for _ in range(4)] == ["a:0", "b:1", "c:1", "a:1"]
    turns.wait("d", "d:1")
    # It is the turn of the third of a, and then of d, for whom a gives way.
    assert (turns.host, turns.most()) == ("a", [])
    turns.begin()
    assert (turns.host, turns.most(), len(turns)) == ("d", ["a:0", "a:1", "a:2"], 5)
    turns.wait("a", "a:0")
    turns.forget("a", "a:1")
    assert (turns.most(), len(turns)) == ([], 3)
    turns.forget("d", "d:1")
    assert (turns.begin(), turns.host) == ("a:0", "")


def record(label, port, hosts, kind):
    """The records of one announcement, as Motorcade makes them."""
    return ServiceInfo(
        SERVICE, f"{label}.{SERVICE}", port, 0, 0, {"kind": kind}, f"{label}.local.", parsed_addresses=hosts
    )


class FleetStranger:
    """Whoever sends what they like to the group of multicast DNS."""

    def __init__(self):
        self._network = Zeroconf(interfaces=[HOST])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._network.close()

    def send(self, info, ttl=None):
        out = DNSOutgoing(_FLAGS_QR_RESPONSE | _FLAGS_AA)
        for each in (info.dns_pointer(ttl), info.dns_service(ttl), info.dns_text(ttl), *info.dns_addresses(ttl)):
            out.add_answer_at_time(each, 0)
        self._network.send(out)


@pytest.mark.parametrize("before", ["nothing", "class", "renewed", "another host", "goodbye"])
def test_a_car_is_found_by_multicast_dns_whatever_a_stranger_sends_in_its_name(before):
    with simulated_cars(1) as (car,), FleetStranger() as network, FleetStranger() as stranger:
        port = int(car.address.rpartition(":")[2])
        own = record("ada", port, [HOST], CAR)
        lies = {
            "class": (record("ada", port, [HOST], CLASS), None),
            "renewed": (record("ada", 9, [HOST], CAR), None),
            "another host": (record("ada", port, ["127.0.0.9", "::1"], CAR), None),
            "goodbye": (own, 0),
        }

        async def test():
            async with Cars() as cars, (finder := Finder(cars)).looking([HOST]):

                def lie():
                    if before in lies:
                        stranger.send(*lies[before])

                def see():
                    lie()
                    network.send(own)
                    lie()
                    return [each for each in cars.statuses() if each.where == car.address and not each.away]

                await until(see)
                cars.order(STOP)
                await until(lambda: car.wheels == (0, 0))
                await until(lambda: finder.problem is None)

        asyncio.run(test())
