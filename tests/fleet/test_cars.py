"""Many cars at real ports of this computer: found, told apart, loaded, stopped; and what isn't a car."""

import asyncio
import sys
import threading
import time
from binascii import crc32
from contextlib import closing, contextmanager, suppress
from datetime import UTC, datetime

import pytest
from serial.tools import list_ports
from serial.tools.list_ports_common import ListPortInfo

from motorcade import Program, compile_program, forward, led
from motorcade.car.loop import Car
from motorcade.drive.certificates import CarKeys, list_keys, make_keys
from motorcade.drive.keys import client_context, peer_number, server_context
from motorcade.errors import MotorcadeError
from motorcade.fleet.cars import Cars, Finder
from motorcade.fleet.contact import Contact
from motorcade.fleet.places import Place, place_of
from motorcade.words.request import (
    ASK,
    BLINK,
    GO,
    NAME,
    REQUEST_BYTES,
    STOP,
    answer_line,
    car_request,
    read_request,
)
from support.fault_proxy import FaultProxy
from support.mock_clock import mock_clock
from support.pseudo_terminal import PseudoTerminal
from support.rooms import FIRST, FIRST_CRC32, SECOND, SECOND_CRC32, SimulatedCar, in_loop, server, simulated_cars
from support.waiting import until

LARGEST = compile_program(Program([forward(1), led(1, 1)] * 120)).image


def places(cars):
    return [place_of(car.address) for car in cars]


@in_loop
async def test_each_car_says_who_it_is_and_what_it_holds():
    with simulated_cars(2, version="0.1.0", battery_mv=lambda: 7400) as made:
        async with Cars(places(made)) as cars:
            await cars.known(30)
            ada, bo = cars.statuses()
    assert (ada.name, bo.name) == ("car-0", "car-1")
    assert ada._replace(silent_s=None, where="") == (
        *("car-0", "", "car", 0, "leader", "simulated", "0.1.0", "runs"),
        *(3, FIRST_CRC32, 7400, False, None, None),
    )
    assert f"{crc32(FIRST):08x}" == FIRST_CRC32


@in_loop
async def test_a_car_blinks_without_leaving_its_program_and_keeps_a_new_name():
    with simulated_cars(2) as made:
        async with Cars(places(made)) as cars:
            await cars.known(30)
            await until(lambda: made[0].states)
            await cars.ask(["car-0"], BLINK)
            await until(lambda: {0, 1, 2, 3, 4} <= set(made[0].leds))
            # It still runs its first state, or goes on to the second.
            assert made[0].states == list(range(len(made[0].states)))
            await cars.ask(["car-0"], NAME, "阿达")
            assert cars.statuses()[1].name == "阿达"
            for bad in ("", "a b", "a" * 33, "all", "a/b", "<b>"):
                with pytest.raises(MotorcadeError, match="no name for a car"):
                    await cars.ask(["阿达"], NAME, bad)
        assert (made[0].named, made[1].named) == ("阿达", "car-1")
        assert made[1].leds == [4]


@in_loop
async def test_all_are_stopped_and_all_begin_anew():
    with simulated_cars(3) as made:
        async with Cars(places(made)) as cars:
            await cars.known(30)
            await until(lambda: all(car.wheels != (0, 0) for car in made))
            cars.order(STOP)
            assert await cars.confirmed(30) == []
            assert [car.wheels for car in made] == [(0, 0)] * 3
            # One that is found later is stopped, too.
            with simulated_cars(1) as (late,):
                cars.add(place_of(late.address)._replace(found=True))
                await until(lambda: cars.contacts[late.address].status().state == "stopped")
                assert late.wheels == (0, 0)
                for car in (late, made[0]):
                    cars.remove(car.address)
            # What somebody named stays.
            assert list(cars.contacts) == [car.address for car in made]
            # What is loaded meanwhile waits, too.
            assert [each.error for each in await cars.load(SECOND, ["all"])] == [None] * 3
            assert [car.wheels for car in made] == [(0, 0)] * 3
            for car in made:
                car.states.clear()
            cars.order(GO)
            assert await cars.confirmed(30) == []
            await until(lambda: all(car.states[:1] == [0] for car in made))


@in_loop
async def test_a_stop_is_not_confirmed_by_the_answer_to_the_one_before():
    stops = []

    async def serve(reader, writer):
        with closing(writer), suppress(asyncio.IncompleteReadError):
            while request := read_request(await reader.readexactly(REQUEST_BYTES)):
                if request.kind == STOP:
                    stops.append(lambda request=request: writer.write(answer_line(request, (("state", "stopped"),))))
                else:
                    writer.write(answer_line(request, ()))

    listener = await asyncio.start_server(serve, "127.0.0.1", 0)
    port = listener.sockets[0].getsockname()[1]
    async with listener, Cars([place_of(f"127.0.0.1:{port}")]) as cars:
        await cars.known(30)
        for _ in range(2):
            cars.order(STOP)
        await until(lambda: len(stops) >= 2)
        stops[0]()
        await until(lambda: cars.statuses()[0].state == "stopped")
        assert len(await cars.confirmed(0)) == 1
        stops[1]()
        assert await cars.confirmed(30) == []


@in_loop
async def test_a_load_gives_each_car_a_verdict_and_takes_those_that_failed_again():
    stored = {}

    def full(data):
        raise OSError("full")

    with simulated_cars(2, save=lambda data: stored.setdefault(data, 0)) as good, simulated_cars(1, save=full) as bad:
        async with server(b"") as mute, Cars([*places(good), *places(bad), place_of(mute)]) as cars:
            await until(lambda: len([each for each in cars.statuses() if not each.away]) == 3)
            verdicts = {each.where: each for each in await cars.load(SECOND, ["all"])}
            assert [verdicts[car.address].holds for car in good] == ["new", "new"]
            assert (verdicts[bad[0].address].holds, verdicts[mute].holds) == ("old", "away")
            assert "could not be stored" in str(verdicts[bad[0].address].error)
            # Once more: those that hold it are left alone.
            await until(lambda: [each.crc32 for each in cars.statuses()].count(SECOND_CRC32) == 2)
            sent = []
            await cars.load(SECOND, ["all"], lambda contact, count: sent.append(contact.place.address), SECOND_CRC32)
            assert set(sent) <= {bad[0].address, mute}
        assert [car.image for car in [*good, *bad]] == [SECOND, SECOND, FIRST]


@in_loop
async def test_a_load_whose_connection_breaks_is_done_again():
    with simulated_cars(1) as (car,):
        async with FaultProxy(int(car.address.rpartition(":")[2])) as proxy, Cars() as cars:
            cars.add(place_of(f"127.0.0.1:{proxy.port}"))
            await cars.known(30)
            breaks = iter([proxy.cut])

            def cut_once(contact, sent):
                next(breaks, lambda: None)()

            (verdict,) = await cars.load(SECOND, ["all"], cut_once)
        assert (verdict.holds, verdict.error, next(breaks, None)) == ("new", None, None)
        assert car.image == SECOND


@pytest.mark.parametrize(
    ("answer", "code"),
    [
        (b"ERR image-header word=0xF0F0F0FD\n", "car-old-protocol"),
        (b"\xff\x00<script>garbage\n" * 50, "no-car-at-port"),
        (b"OK car=a00 name=x sum=00000000\n", "car-away"),
        (bytes(5000), "no-car-at-port"),
    ],
)
@in_loop
async def test_what_answers_otherwise_is_no_car_or_an_old_one(answer, code):
    async with (
        server(answer) as address,
        Cars([Place(address, "ada", host="127.0.0.1", port=int(address[10:]))]) as cars,
    ):
        contact = cars.named(["ada"])[0]
        cars.order(STOP)
        problem = await until(lambda: contact.status().problem)
        assert problem.code == code
        assert all(problem.sentence(language) for language in ("en", "zh"))
        assert [each.where for each in await cars.confirmed(0.1)] == [address]


@in_loop
async def test_a_car_of_a_list_by_its_hosts_name_is_no_second_car_where_it_is_found_too():
    """Whichever comes first; the one that somebody wrote stays."""

    with simulated_cars(1) as made:
        port = made[0].address.rpartition(":")[2]
        found = place_of(made[0].address)._replace(found=True)
        async with Cars() as cars:
            cars.add(found)
            await cars.known(30)
            cars.add(place_of(f"localhost:{port}", "ada"))
            await until(lambda: list(cars.contacts) == [f"localhost:{port}"])
            cars.add(found)
            assert [each.where for each in cars.statuses()] == [f"localhost:{port}"]


@in_loop
async def test_the_turn_of_a_car_that_is_forgotten_is_the_next_ones():
    with simulated_cars(2) as made:
        async with Cars() as cars:
            cars.most_at_once = 1
            first, second = places(made)
            for place in (first, second):
                cars.add(place._replace(found=True))
            await until(lambda: cars.contacts[first.address].has_answered)
            cars.remove(first.address)
            await until(lambda: cars.contacts[second.address].has_answered)


@in_loop
async def test_two_cars_of_one_name_are_told_apart_by_their_addresses():
    with simulated_cars(2, name="ada") as made:
        async with Cars(places(made)) as cars:
            await cars.known(30)
            with pytest.raises(MotorcadeError, match="Two cars are named ada") as refused:
                await cars.ask(["ada"], BLINK)
            assert all(car.address in str(refused.value) for car in made)
            await cars.ask([made[1].address], BLINK)
            with pytest.raises(MotorcadeError, match="There is no car bo"):
                cars.named(["bo"])


@pytest.mark.parametrize("breaks", [True, False], ids=["hangs up", "says nothing"])
@mock_clock
async def test_who_asks_a_car_that_is_lost_at_that_moment_is_told_so(breaks):
    async def serve(reader, writer):
        with closing(writer), suppress(asyncio.IncompleteReadError):
            while (request := read_request(await reader.readexactly(REQUEST_BYTES))).kind == ASK:
                writer.write(answer_line(request, (("name", "ada"),)))
            if not breaks:
                await reader.read()

    listener = await asyncio.start_server(serve, "127.0.0.1", 0)
    port = listener.sockets[0].getsockname()[1]
    async with listener, Cars([place_of(f"127.0.0.1:{port}")]) as cars:
        await cars.known(30)
        with pytest.raises(MotorcadeError) as refused:
            await cars.ask(["ada"], BLINK)
        assert (refused.value.code, refused.value.details) == ("car-away", {"car": "ada"})


@contextmanager
def car_at_a_cable(folder):
    """Run a car at a pseudo-terminal; yields it, its port in ``folder``, and a function that pulls the cable."""
    line, pulled, port = PseudoTerminal(), threading.Event(), folder / "cable"
    # Another process may soon have the terminal's own name.
    port.symlink_to(line.address)
    car = SimulatedCar(7, line)
    # Nothing that is sent after a pull is read.
    reading = threading.Lock()

    def run():
        driven = Car(car)
        while not pulled.is_set():
            line.wait(0.001)
            with reading:
                if not pulled.is_set():
                    driven.tick()
        line.close()

    def pull():
        port.unlink(missing_ok=True)
        with reading:
            pulled.set()

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield car, str(port), pull
    finally:
        pulled.set()
        thread.join()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")
@in_loop
async def test_a_cable_that_is_pulled_in_an_upload_is_one_verdict_and_the_others_go_on(tmp_path):
    with simulated_cars(2) as made, car_at_a_cable(tmp_path) as (pulled, port, pull_cable):
        async with Cars([Place(port), *places(made)]) as cars:
            await cars.known(30)
            assert [each.away for each in cars.statuses()] == [False] * 3

            def pull(contact, sent):
                if contact.place.address == port and sent > len(LARGEST) // 2:
                    pull_cable()

            verdicts = {each.where: each for each in await cars.load(LARGEST, ["all"], pull)}
        assert [verdicts[car.address].holds for car in made] == ["new", "new"]
        assert (verdicts[port].error.code, pulled.image) == ("went-away", FIRST)
        assert all(verdicts[port].error.sentence(language) for language in ("en", "zh"))


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")
@in_loop
async def test_a_car_is_found_when_its_cable_is_plugged_in_and_forgotten_when_it_is_pulled(tmp_path, monkeypatch):
    there = []
    monkeypatch.setattr(list_ports, "comports", lambda: [*there])
    with car_at_a_cable(tmp_path) as (_, port, _):
        async with Cars() as cars, Finder(cars).looking(["127.0.0.1"]):
            board, mouse = ListPortInfo(port), ListPortInfo("/dev/no-board")
            board.vid, board.pid = 0x1A86, 0x7523
            there.extend([board, mouse])
            await until(lambda: port in cars.contacts and not cars.contacts[port].status().away)
            assert mouse.device not in cars.contacts
            there.clear()
            await until(lambda: port not in cars.contacts)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")
@in_loop
async def test_a_serial_device_that_is_no_car_is_left_alone_and_one_that_vanishes_is_away():
    """Its other end says a line now and then, as a GPS receiver does: it never gets a byte."""

    line = PseudoTerminal()
    contact = Contact(Place(line.address, found=True), None, 115200)
    task = asyncio.create_task(contact.run())
    while not task.done():
        line.write(b"$GPGGA,,,,,,0,,,,,,,,*66\r\n")
        await asyncio.sleep(0.05)
    assert contact.status().problem.code == "no-car-at-port"
    assert line.read() == b""
    line.close()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")
@in_loop
async def test_a_prompt_that_shows_what_it_is_sent_has_an_empty_line_afterwards():
    """As MicroPython's: it takes what can be printed, and never the end of a line."""

    line, typed = PseudoTerminal(), bytearray()
    contact = Contact(Place(line.address, found=True), None, 115200)
    task = asyncio.create_task(contact.run())

    def edit():
        for byte in line.read():
            assert byte >= 32
            if byte == 127:
                del typed[-1:]
                line.write(b"\b \b")
            elif byte < 127:
                typed.append(byte)
                seen.append(byte)
                line.write(bytes([byte]))
        return task.done() and not typed

    seen = bytearray()
    await until(edit)
    assert contact.status().problem.code == "no-car-at-port"
    # It was asked once.
    assert len(seen) == len(car_request(ASK, 0)) - 4
    line.close()


def test_keys_are_required_and_revoked_ones_refused(tmp_path):
    make_keys(tmp_path, [CarKeys("ada")], ["eve", "bea"], datetime.now(UTC))
    revoked = set()

    async def reached(keys):
        async with Cars([place_of(f"localhost:{made[0].address[10:]}")], keys) as cars:
            await until(lambda: cars.named(["all"])[0].is_known.is_set())
            await cars.known(30)
            (status,) = cars.statuses()
            if not status.away:
                assert [each.error for each in await cars.load(SECOND, ["all"])] == [None]
            return status.problem.code if status.problem else status.name

    tls = server_context(tmp_path / "car-ada.pem")
    with simulated_cars(1, tls=tls, refuses=lambda line: peer_number(line) in revoked) as made:
        assert asyncio.run(reached(None)) == "car-away"
        assert made[0].image == FIRST
        bea = client_context(tmp_path / "driver-bea.pem")
        assert asyncio.run(reached(bea)) == "car-0"
        assert made[0].image == SECOND
        revoked |= {each.number for each in list_keys(tmp_path) if each.name == "bea"}
        assert asyncio.run(reached(bea)) == "car-away"
        eve = client_context(tmp_path / "driver-eve.pem")
        assert asyncio.run(reached(eve)) == "car-0"


@in_loop
async def test_keys_for_a_car_without_keys_end_in_a_sentence_that_says_so(tmp_path):
    make_keys(tmp_path, [CarKeys("ada")], ["eve"], datetime.now(UTC))
    with simulated_cars(1) as made:
        keys = client_context(tmp_path / "driver-eve.pem")
        async with Cars([place_of(f"localhost:{made[0].address[10:]}")], keys) as cars:
            (contact,) = cars.contacts.values()
            await until(lambda: contact.status().problem)
            assert contact.status().problem.code == "car-takes-no-keys"


@pytest.mark.parametrize("flood", [b"\n" * (1 << 18), b"x" * 4000 + b"\n", b"ERR no\n" * 40000])
@in_loop
async def test_what_floods_an_upload_is_hung_up_at_little_cost(flood):
    """It answers like a car who it is, and floods whatever comes then."""
    sent_bytes = 0

    async def serve(reader, writer):
        nonlocal sent_bytes
        with closing(writer), suppress(OSError, asyncio.IncompleteReadError):
            request = read_request(await reader.readexactly(REQUEST_BYTES))
            writer.write(answer_line(request, (("name", "ada"),)))
            await reader.readexactly(1)
            while True:
                writer.write(flood)
                sent_bytes += len(flood)
                await writer.drain()

    listener = await asyncio.start_server(serve, "127.0.0.1", 0)
    port = listener.sockets[0].getsockname()[1]
    async with listener, Cars([place_of(f"127.0.0.1:{port}")]) as cars:
        await cars.known(30)
        begin_s = time.process_time()
        (verdict,) = await cars.load(SECOND, ["all"])
        assert verdict.error is not None
        assert time.process_time() - begin_s < 2.0
    # The buffers of the system are filled, and no more is read.
    assert sent_bytes < 1 << 24
