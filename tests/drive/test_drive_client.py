"""A driver's end and a car in one event loop with a mock clock: real sockets, no waiting; keys, and bad networks."""

import asyncio
import socket
import threading
from contextlib import AsyncExitStack, asynccontextmanager, closing, suppress
from dataclasses import replace
from inspect import signature

import pytest

from motorcade.drive.blocking_client import BlockingDriveClient
from motorcade.drive.client import DriveClient
from motorcade.drive.connection import CarRefusesError
from motorcade.drive.keys import server_context
from motorcade.drive.session import CarControl
from motorcade.drive.wire import pack_frame
from motorcade.errors import DriveError, InputError, MotorcadeError
from support.driven_car import deaf_port
from support.loop_car import loop_car
from support.mock_board import CLASSROOM, NEUTRAL, MockDriveBoard
from support.mock_clock import mock_clock, pass_time
from support.rooms import in_loop
from support.waiting import until, wait_until
from support.working_drivers import HALF, behind_proxies, client, come_and_drive, drive_on, driving

AHEAD = (90, 1, 128)


@mock_clock
async def test_a_command_reaches_the_wheels_and_leaving_stops_them():
    async with loop_car() as car:
        async with client(car) as driver:
            with pytest.raises(ValueError, match=r"throttle is 1\.1; allowed: -1 to 1"):
                await driver.drive(throttle=1.1)
            async with driving(driver, 0.4, -0.2):
                await until(lambda: driver.telemetry and driver.telemetry.state == "moving")
                assert driver.telemetry[1:4] == (108, 1, 102)
                assert driver.you["drives"]
                assert driver.telemetry.driver == driver.you["name"]
        await until(lambda: car.board.setpoint == NEUTRAL)
        # The client stopped the car before it hung up, so the next driver finds a car that is ready.
        assert car.control.telemetry().failsafes == 0


@mock_clock
async def test_who_only_looks_sends_no_command_and_takes_no_place():
    async with loop_car() as car:
        async with client(car) as watcher:
            await watcher.next_telemetry()
            (channel,) = car.server.commands
        await until(lambda: not car.server.commands)
    assert not any(channel.own.counts.values())


@mock_clock
async def test_driving_for_a_time_ends_by_itself():
    async with loop_car() as car, client(car, fresh_s=1) as driver:
        await driver.drive_for(0.4, -0.5, 1)
        await until(lambda: car.board.was_told((0, 0, 128)) and not car.board.moves)
        first_s = next(at_s for at_s, setpoint in car.board.notes if setpoint[2])
        # A car that was at rest takes a tenth of a second to be ready.
        assert 0.29 < car.board.notes[-1][0] - first_s < 0.41


@mock_clock
async def test_driving_for_a_time_begins_when_the_car_can_move_however_slow_the_network_is():
    async with loop_car() as car, behind_proxies(car) as (driver, proxies):
        for proxy in proxies:
            proxy.delay_s = 0.25
        # The client knows the car, which has not asked for the client's clock yet.
        await until(lambda: driver.you)
        await driver.drive_for(0.4, 0.5)
        await until(lambda: car.board.has_moved() and not car.board.moves)


@mock_clock
async def test_a_caller_that_hangs_stops_the_car_though_the_connection_works():
    async with loop_car() as car, client(car, fresh_s=0.1) as driver:
        async with driving(driver):
            await until(car.board.has_moved)
        last_s = asyncio.get_running_loop().time()
        await until(lambda: not car.board.moves)
        assert asyncio.get_running_loop().time() - last_s < 0.2
        count = len(car.board.notes)
        for _ in range(6):
            assert (await driver.next_telemetry()).state != "moving"
        assert driver.connected
        assert not car.board.has_moved(count)


@mock_clock
async def test_a_new_driver_drives_within_half_a_second():
    loop = asyncio.get_running_loop()
    for wait_s in (0, 0.07, 5):
        async with loop_car() as car, client(car) as driver:
            await pass_time(wait_s)
            begin_s = loop.time()
            async with driving(driver, 0.5, 0):
                await until(car.board.has_moved)
                assert loop.time() - begin_s < 0.5


@mock_clock
async def test_only_the_newest_command_is_sent_and_no_more_than_the_car_takes():
    async with loop_car() as car, client(car) as driver:
        loop = asyncio.get_running_loop()
        end_s = loop.time() + 0.5
        while loop.time() < end_s:
            await driver.drive(HALF)
            await pass_time(0.001)
        await driver.next_telemetry()
        await driver.next_telemetry()
        assert driver.you["over-rate"] == 0
        assert 5 < driver.you["applied"] <= 50


@mock_clock
async def test_two_drivers_hand_the_wheel_over_and_anyone_stops_the_car():
    async with loop_car() as car, client(car, fresh_s=1) as first, client(car) as second:
        async with driving(first):
            await until(lambda: first.you.get("drives") and car.board.moves)
            assert await second.request() is False
            await until(lambda: second.you and first.telemetry.wanted_by == second.you["name"])
            await second.stop()
            await until(lambda: not car.board.moves and first.telemetry.state == "stopped")
            await second.clear()
        async with driving(second):
            await until(lambda: second.you["drives"] and car.board.moves)
        await second.release()
        async with driving(first):
            await until(lambda: first.you["drives"] and car.board.moves)


@mock_clock
async def test_a_car_that_refuses_gives_its_reason_and_one_without_telemetry_is_driven_too():
    async with loop_car() as car:
        async with client(car) as driver:
            with pytest.raises(CarRefusesError, match="no program") as refused:
                await driver.resume_program()
            assert "程序" in refused.value.sentence("zh")
        async with DriveClient("127.0.0.1", car.port, telemetry_port=0) as bare, driving(bare):
            await until(lambda: car.board.setpoint == AHEAD)
            with pytest.raises(DriveError, match="telemetry port"):
                await bare.stop()


@mock_clock
async def test_a_full_car_is_distinguished_from_an_absent_one():
    async with loop_car() as car, AsyncExitStack() as stack:
        for _ in range(9):
            watcher = await stack.enter_async_context(client(car))
            await watcher.request()
        with pytest.raises(DriveError) as full:
            await come_and_drive(client(car, patience_s=2))
        assert "9" in str(full.value)
        assert "满" in full.value.sentence("zh")


@mock_clock
async def test_where_no_car_is_the_sentence_names_the_address_and_the_reason():
    with deaf_port() as port, pytest.raises(DriveError, match=f":{port} .*no program listens there.*drive serve"):
        async with DriveClient("127.0.0.1", port, patience_s=2):
            pass
    begin_s = asyncio.get_running_loop().time()
    with pytest.raises(DriveError, match=r"no address 'there-is-none\.invalid'"):
        async with DriveClient("there-is-none.invalid", patience_s=600):
            pass
    assert asyncio.get_running_loop().time() - begin_s < 300


@mock_clock
async def test_a_car_whose_port_for_telemetry_is_closed_is_told_from_an_absent_one():
    with socket.socket() as closed:
        closed.bind(("127.0.0.1", 0))
        async with loop_car() as car:
            driver = DriveClient("127.0.0.1", car.port, telemetry_port=closed.getsockname()[1], patience_s=1)
            with pytest.raises(DriveError) as refused:
                await driver.__aenter__()
    assert refused.value.code == "no-telemetry"


@mock_clock
async def test_a_client_without_patience_gives_up_at_the_first_try():
    begin_s = asyncio.get_running_loop().time()
    with deaf_port() as port, pytest.raises(DriveError):
        async with DriveClient("127.0.0.1", port, patience_s=0):
            pass
    assert asyncio.get_running_loop().time() - begin_s < 1


@mock_clock
async def test_a_car_that_stays_away_is_an_error_of_the_next_command():
    async with AsyncExitStack() as stack:
        async with loop_car() as car:
            driver = await stack.enter_async_context(client(car, patience_s=0.2))
            await driver.next_telemetry()
        with pytest.raises(DriveError, match=r"has been away for \d+ s"):
            await drive_on(driver)
        with pytest.raises(DriveError, match="away"):
            await driver.stop()
        with pytest.raises(DriveError, match="away"):
            await driver.next_telemetry()


def telemetry_frame(**other):
    """The frame that a car at rest sends, with other values."""
    at_rest = CarControl(MockDriveBoard(lambda: 0.0), lambda: 0, CLASSROOM).telemetry()
    return pack_frame({"kind": "telemetry"} | at_rest._asdict() | other)


@asynccontextmanager
async def own_car(frame):
    """A server that sends this as its telemetry, and a client of it."""

    async def send(reader, writer):
        with closing(writer), suppress(OSError):
            writer.write(frame)
            await reader.read()

    async with AsyncExitStack() as servers:
        listeners = [
            await servers.enter_async_context(await asyncio.start_server(send, "127.0.0.1", 0)) for _ in range(2)
        ]
        port, telemetry_port = (listener.sockets[0].getsockname()[1] for listener in listeners)
        driver = DriveClient("127.0.0.1", port, telemetry_port=telemetry_port, patience_s=0.1)
        driver.begin()
        try:
            yield driver
        finally:
            await driver.end()


@pytest.mark.parametrize(
    "frame",
    [
        *(telemetry_frame(you=you) for you in ([1], "ada", 5, True, {"clock": [1]}, {"name": {}}, {"clock": 1 << 60})),
        *(telemetry_frame(state=state) for state in ("asleep", "\x1b[2J", "", None, 3)),
        *(telemetry_frame(battery_mv=mv) for mv in (7.4, "7", 1 << 60)),
        *(telemetry_frame(switches=switches) for switches in (None, [], {"horn": "on"}, {"horn": 2})),
    ],
)
@in_loop
async def test_telemetry_that_no_car_sends_ends_the_connection_in_a_sentence(frame):
    """Nothing of it comes to a table, a terminal or a page, which could not show it."""
    async with own_car(frame) as driver:
        await until(lambda: driver.problem)
        with pytest.raises(DriveError, match="the connection ended"):
            await driver.next_telemetry()


@in_loop
async def test_a_client_that_lost_the_wheel_without_a_name_goes_on():
    """A car that says no name is no reason to end."""
    frames = [telemetry_frame(you=you) for you in ({"drives": True}, {"name": "ada", "drives": False})]
    async with own_car(b"".join(frames)) as driver:
        await until(lambda: driver.you.get("name"))
        assert driver.problem is None


@pytest.mark.parametrize("floods", ["commands", "telemetry"])
@in_loop
async def test_a_car_that_floods_is_hung_up(floods):
    """Ten frames a second are a car's; what a peer may cost has a bound."""
    frame = telemetry_frame() * 1000
    sent_bytes = 0

    async def flood(reader, writer):
        nonlocal sent_bytes
        with closing(writer), suppress(OSError):
            while sent_bytes < 1 << 26:
                writer.write(frame)
                sent_bytes += len(frame)
                await writer.drain()

    async def wait(reader, writer):
        with closing(writer), suppress(OSError):
            await reader.read()

    places = {}
    async with AsyncExitStack() as servers:
        for name in ("commands", "telemetry"):
            listener = await asyncio.start_server(flood if name == floods else wait, "127.0.0.1", 0)
            places[name] = listener.sockets[0].getsockname()[1]
            await servers.enter_async_context(listener)
        driver = DriveClient("127.0.0.1", places["commands"], telemetry_port=places["telemetry"])
        driver.begin()
        await until(lambda: driver.problem)
        await driver.end()
    # The buffers of the system are filled, and little more is read.
    assert sent_bytes < 1 << 25


def test_a_freshness_far_beyond_the_failsafe_is_refused():
    for fresh_s in (0.01, 1.5, float("nan"), "1"):
        with pytest.raises(InputError, match="fresh_s is"):
            DriveClient("127.0.0.1", fresh_s=fresh_s)


@pytest.mark.parametrize("port", ["5005", 0, -1, 1 << 16, 5005.5, None])
def test_a_port_that_is_none_is_refused_before_anybody_is_called(port):
    with pytest.raises(InputError, match="port is"):
        DriveClient("127.0.0.1", port)


# With keys: it drives a car that it trusts and that trusts it; else the sentence speaks of keys


@pytest.fixture
def tls(keys):
    return server_context(keys / "car-ada.pem")


@mock_clock
async def test_with_keys_a_driver_drives_under_the_name_in_them_and_goes_on_hearing(tls, keys):
    async with loop_car(tls) as car, client(car, keys=keys / "driver-lin.pem") as driver, driving(driver):
        await until(lambda: driver.telemetry and driver.telemetry.driver)
        assert driver.telemetry.driver.startswith("lin")
        await until(lambda: car.board.moves)
        names = set()
        for _ in range(8):
            await driver.next_telemetry()
            names.add(driver.you.get("name"))
        assert len(names) == 1
        await driver.stop()
        await until(lambda: not car.board.moves)


def test_a_name_that_is_found_after_its_driver_has_left_raises_nothing(monkeypatch):
    found, raised, finders = threading.Event(), [], []

    def look_up(*_, **options):
        finders.append(threading.current_thread())
        found.wait(30)
        return []

    monkeypatch.setattr(socket, "getaddrinfo", look_up)
    monkeypatch.setattr(threading, "excepthook", raised.append)
    with pytest.raises(DriveError), BlockingDriveClient("a-slow-name.example", patience_s=0.05):
        pytest.fail("There is no car.")
    found.set()
    for finder in finders:
        finder.join()
    assert finders
    assert raised == []


@mock_clock
async def test_with_keys_the_host_names_the_car_where_no_other_name_is_given(tls, keys, monkeypatch):
    """Another car of the class, which has keys too, may answer at the address of the host."""
    look_up = socket.getaddrinfo
    monkeypatch.setattr(socket, "getaddrinfo", lambda host, *more, **options: look_up("127.0.0.1", *more, **options))
    async with loop_car(tls) as car:
        at = {"telemetry_port": car.telemetry_port, "keys": keys / "driver-lin.pem", "patience_s": 3}
        async with DriveClient("ada", car.port, **at) as driver:
            await until(lambda: driver.telemetry)
        with pytest.raises(DriveError, match="bob"):
            await come_and_drive(DriveClient("bob", car.port, **at))


@pytest.mark.parametrize(
    ("options", "code", "says"),
    [
        ({"keys": "others/driver-mallory.pem"}, "not-trusted", "doesn't show the certificate"),
        ({"keys": "driver-lin.pem", "car": "bob"}, "not-trusted", "bob"),
        ({}, "says-nothing", "keys"),
    ],
    ids=["of another class", "another car", "none"],
)
@mock_clock
async def test_without_the_right_keys_nobody_drives_and_the_sentence_speaks_of_keys(tls, keys, options, code, says):
    if "keys" in options:
        options = {**options, "keys": keys / options["keys"]}
    async with loop_car(tls) as car:
        with pytest.raises(DriveError, match=says) as raised:
            await come_and_drive(client(car, patience_s=3, **options))
        assert raised.value.code == code
        assert not car.board.has_moved()


@mock_clock
async def test_the_error_of_a_driver_whose_keys_the_car_refuses_speaks_of_keys(keys, tmp_path):
    # The car trusts another authority than the one that its own certificate is from.
    mixed = tmp_path / "mixed.pem"
    own, other = ((keys / name).read_text(encoding="utf-8") for name in ("car-ada.pem", "others/car-eve.pem"))
    mark = "-----BEGIN CERTIFICATE-----"
    mixed.write_text(own[: own.rindex(mark)] + other[other.rindex(mark) :], encoding="utf-8")
    async with loop_car(server_context(mixed)) as car:
        with pytest.raises(CarRefusesError, match="doesn't accept your keys"):
            await come_and_drive(client(car, keys=keys / "driver-lin.pem", patience_s=3))


@mock_clock
async def test_the_error_of_keys_for_a_car_without_keys_is_to_leave_them_out(keys):
    async with loop_car() as car:
        with pytest.raises(DriveError, match=r"started with --keys\?"):
            await come_and_drive(client(car, keys=keys / "driver-lin.pem"))


@mock_clock
async def test_a_client_sends_nothing_to_a_car_that_takes_something_else(keys, tls):
    """Neither keys to a car without them, nor commands to one that wants them."""
    async with loop_car() as car:
        with pytest.raises(DriveError, match="sends telemetry without TLS"):
            await come_and_drive(client(car, keys=keys / "driver-lin.pem", patience_s=2))
        assert (car.control.telemetry().refused, car.control.telemetry().turned_away) == (0, 0)
    async with loop_car(tls) as car:
        said = []
        car.server.refusals.say = said.append
        with pytest.raises(DriveError, match="--keys"):
            await come_and_drive(client(car, patience_s=3))
        assert not car.server.commands
        assert not car.board.has_moved()
        assert said == []


def test_keys_need_telemetry(keys):
    with pytest.raises(MotorcadeError, match="exclude each other"):
        DriveClient("127.0.0.1", telemetry_port=0, keys=keys / "driver-lin.pem")


# Behind bad networks: what its car alone would not make good; `tests/faults` tries the rest


@mock_clock
async def test_a_pulled_cable_is_noticed_and_the_client_gets_its_wheel_again():
    never = replace(CLASSROOM, drive=replace(CLASSROOM.drive, hand_over_ms=600_000))
    async with loop_car(profile=never) as car, behind_proxies(car) as (driver, proxies), driving(driver):
        await until(lambda: car.board.moves and driver.you.get("drives"))
        for proxy in proxies:
            proxy.half_open()
        await until(lambda: not car.board.moves)
        # To the car its former driver still drives, who is this client.
        await until(lambda: car.board.moves)
        assert car.control.telemetry().failsafes >= 1


@mock_clock
async def test_nothing_moves_or_sounds_before_the_client_has_answered_the_cars_clock():
    async with loop_car() as car, behind_proxies(car) as (driver, proxies):
        proxies[1].hold(True)
        for _ in range(20):
            driver.steer(0.0, 0.0, horn=1)
            await pass_time(0.05)
        assert car.board.switched == []
        async with driving(driver):
            await pass_time(1.0)
            assert not car.board.has_moved()
            proxies[1].hold(False)
            await until(lambda: car.board.moves)


# For programs without asyncio


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost"])
def test_a_program_without_asyncio_drives_too(car, host):
    with BlockingDriveClient(host, car.port, telemetry_port=car.telemetry_port) as driver:
        assert driver.connected
        driver.drive(throttle=HALF)
        wait_until(car.board.has_moved)
        driver.drive_for(0.3, HALF, 1)
        assert driver.next_telemetry()
        assert driver.request() is True
        driver.stop()
        wait_until(lambda: driver.telemetry.state == "stopped")
        driver.clear()
        driver.release()
        with pytest.raises(CarRefusesError):
            driver.resume_program()
    wait_until(lambda: car.board.setpoint == NEUTRAL)


def test_a_blocking_client_that_finds_no_car_leaves_no_thread_behind():
    before = set(threading.enumerate())
    with deaf_port() as port:
        finds_none = pytest.raises(DriveError)
        with finds_none, BlockingDriveClient("127.0.0.1", port, patience_s=0.2):
            pass
    assert set(threading.enumerate()) <= before


@pytest.mark.parametrize("name", ["drive", "drive_for"])
def test_what_a_program_leaves_out_is_the_same_with_and_without_asyncio(name):
    blocking, plain = (signature(getattr(kind, name)).parameters for kind in (BlockingDriveClient, DriveClient))
    assert {each: blocking[each].default for each in blocking} == {each: plain[each].default for each in plain}
