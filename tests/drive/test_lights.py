"""Lights and horn, the drive code 2: who switches them, when they end, and what does it on both kinds of boards."""

import pytest
from starlette.testclient import TestClient

from motorcade.config.profile import built_in_profile
from motorcade.drive.deadman import DeadmanSwitch
from motorcade.drive.motors import Switchboard
from motorcade.drive.session import ControlSession
from motorcade.drive.stamps import Freshness, stamp_at
from motorcade.drive.wire import OUTCOMES
from motorcade.engine.simulated_drive import SimulatedBoard
from motorcade.errors import MotorcadeError
from motorcade.server.fleet import SingleCar
from motorcade.server.remote import make_remote
from motorcade.server.request_filter import ServerSettings
from motorcade.words.field import WordError
from motorcade.words.formats import DRIVE, LIGHTS, fingerprint, switch_words, switched_by
from support.loop_car import loop_car
from support.mock_board import MockCar, MockDriveBoard
from support.mock_clock import mock_clock, pass_time
from support.remote_page import RemotePage
from support.waiting import until
from support.working_drivers import client, driving

PROFILE = built_in_profile("classroom")
STILL = DRIVE.encode(angle=90, direction=1, speed=0)
MOVE = DRIVE.encode(angle=90, direction=1, speed=100)
BOTH, LIGHT, HORN, NEITHER = (LIGHTS.encode(head_light=bits >> 1, horn=bits & 1) for bits in (3, 2, 1, 0))


class SwitchedCar(MockCar):
    """A simulated car, which has all switches, and its driver."""

    def __init__(self, board=None):
        super().__init__(board=board or SimulatedBoard(has_program=True))
        self.driver = ControlSession(self.control, "ada")
        self.driver.command(STILL)

    def take(self, session, word):
        return OUTCOMES[session.command(word)]

    @property
    def on(self):
        return self.board.switched_on


@pytest.fixture
def car():
    return SwitchedCar()


def test_the_bits_and_their_fingerprint():
    assert (BOTH, LIGHT, HORN, NEITHER) == (0x2C000000, 0x28000000, 0x24000000, 0x20000000)
    assert fingerprint(LIGHTS) == 0x720F1FEA
    with pytest.raises(WordError, match="reserved"):
        LIGHTS.decode(NEITHER | 1 << 11, strict=True)


def test_the_driver_switches_and_telemetry_says_so(car):
    assert car.take(car.driver, BOTH) == "applied"
    assert car.on == {"head_light", "horn"}
    assert car.control.telemetry().switches == {"head_light": 1, "horn": 1}
    assert car.take(car.driver, NEITHER) == "applied"
    assert car.on == set()


def test_who_watches_switches_nothing(car):
    watcher = ControlSession(car.control, "grace")
    assert car.take(watcher, BOTH) == "watching"
    car.driver.release()
    # Nobody drives: this gives nobody the wheel.
    assert car.take(watcher, BOTH) == "watching"
    assert (car.on, car.control.telemetry().driver) == (set(), None)


def test_the_horn_is_silent_when_its_driver_is_and_the_light_stays(car):
    car.driver.command(BOTH)
    car.now_ms = 300
    car.control.beat()
    assert car.on == {"head_light", "horn"}
    car.now_ms = 301
    car.control.beat()
    assert car.on == {"head_light"}


@pytest.mark.parametrize("what", ["failsafe", "stop", "release", "program", "stall", "leave"])
def test_what_ends_the_drive_silences_the_horn_at_once(car, what):
    car.driver.command(MOVE)
    car.now_ms = 200
    car.driver.command(BOTH)
    if what == "failsafe":
        car.now_ms = 301
        car.control.beat()
    elif what == "stall":
        car.control.fail(OSError("stuck"))
    else:
        getattr(car.driver, "resume_program" if what == "program" else what)()
    assert car.on == (set() if what == "leave" else {"head_light"})


def test_the_horn_delays_no_failsafe(car):
    car.driver.command(MOVE)
    for car.now_ms in range(0, 400, 50):
        car.driver.command(HORN)
        car.control.beat()
    assert car.control.telemetry().state == "failsafe"


def test_the_next_driver_finds_the_light_on_until_who_switched_it_on_leaves(car):
    car.driver.command(LIGHT)
    other = ControlSession(car.control, "grace")
    other.request()
    assert other.drives
    assert car.on == {"head_light"}
    car.driver.leave()
    assert car.on == set()


@pytest.mark.parametrize(("before", "outcome"), [("stop", "stopped"), ("resume_program", "program")])
def test_while_a_stop_holds_or_the_program_drives_nothing_is_switched(car, before, outcome):
    getattr(car.driver, before)()
    assert car.take(car.driver, BOTH) == outcome
    assert car.on == set()


def test_a_board_without_them_does_nothing_and_counts_it():
    car = SwitchedCar(MockDriveBoard(switches=()))
    assert car.take(car.driver, BOTH) == "no-hardware"
    assert car.control.telemetry().switches == {}


def test_a_switch_that_fails_is_a_fault_stops_no_wheels_and_is_tried_again(car):
    def fail(name, is_on):
        raise OSError("the horn's wire is out")

    works, car.board.set_switch = car.board.set_switch, fail
    car.driver.command(MOVE)
    car.driver.command(HORN)
    assert (car.control.telemetry().state, car.control.telemetry().last_fault) == ("moving", "the horn's wire is out")
    car.board.set_switch = works
    car.control.beat()
    assert car.on == {"horn"}


def test_an_unknown_code_and_an_unknown_switch_are_named(car):
    with pytest.raises(WordError, match=r"code is 3; allowed: 1 \(speed and direction\), or 2 \(lights and horn\)"):
        car.driver.command(3 << 28)
    with pytest.raises(MotorcadeError, match="'siren' on any car; there is: head_light, horn"):
        switch_words({"siren": 1}, {})


def test_a_command_of_a_later_edition_switches_nothing():
    for bit in range(11, 26):
        with pytest.raises(WordError, match="reserved"):
            switched_by(LIGHT | 1 << bit)


def test_a_command_states_what_it_does_not_switch_as_it_is():
    assert switch_words({"horn": 1}, {"head_light": 1}) == [BOTH]
    assert switch_words({"horn": 1}, {}) == [HORN]
    assert switch_words({}, {"head_light": 1}) == []


def test_what_is_held_is_switched_off_when_it_is_no_longer_commanded():
    switch = DeadmanSwitch()
    switch.command(0, 0, 0, {"horn": 1, "head_light": 1})
    assert (switch.next(0), switch.switches(0)) == ((0, 0), {"horn": 1, "head_light": 1})
    switch.command(0, 0, 50)
    assert (switch.next(50), switch.switches(50)) == ((0, 0), {"horn": 0, "head_light": 1})
    switch.command(0.5, 0, 350, {"horn": 1})
    switch.order()
    assert (switch.next(350), switch.switches(350)) == (None, {})


@mock_clock
async def test_a_client_honks_while_it_commands_that_and_keeps_the_light():
    async with loop_car() as car:
        board = SimulatedBoard(has_program=False)
        car.control.switchboard = Switchboard(board, PROFILE.drive.failsafe_ms)
        async with client(car) as driver:
            async with driving(driver):
                await until(lambda: driver.you.get("drives"))
                await driver.drive(0.5, head_light=True)
                await until(lambda: board.switched_on == {"head_light"})
            while "horn" not in board.switched_on:
                await driver.drive(0.5, horn=True)
                await pass_time(0.05)
            await until(lambda: board.switched_on == {"head_light"})
            await until(lambda: driver.telemetry.switches == {"head_light": 1, "horn": 0})
            with pytest.raises(MotorcadeError, match="siren"):
                await driver.drive(siren=True)
        await until(lambda: board.switched_on == set())


def test_a_page_s_message_switches_the_car():
    car = SwitchedCar()
    app = make_remote(ServerSettings(), SingleCar(car.control))
    with (
        TestClient(app, base_url="http://127.0.0.1:7700") as http,
        http.websocket_connect("ws://127.0.0.1:7700/drive/ws") as socket,
    ):
        car.driver.release()
        page = RemotePage(socket)
        page.send("join", car="1")
        page.send("drive", cars=["1"], throttle=0.0, steering=0.0, switches={"head_light": 1}, number=1)
        assert page.car("1", lambda shown: shown["switches"]["head_light"])["switches"] == {"head_light": 1, "horn": 0}


def test_a_switch_is_not_taken_for_the_first_command_behind_an_answer():
    freshness = Freshness(150)
    freshness.take_answer(250, 0, stamp_at(1000), 1000)
    assert not freshness.is_fresh(stamp_at(1010), 1010, 1, drives=False)
    assert freshness.is_fresh(stamp_at(1020), 1020, 2, stands=True)
    assert freshness.is_fresh(stamp_at(1030), 1030, 3, drives=False)
