"""A listener gives open connections a turn, and leaves nobody's connection behind when it ends."""

import asyncio
import contextlib
import gc
import socket
import ssl
import sys
import threading
from collections.abc import AsyncIterator, Callable
from contextlib import suppress
from functools import partial
from itertools import pairwise

import pytest

from motorcade.drive import listener
from motorcade.drive.keys import client_context, server_context
from motorcade.drive.listener import DRIVE_PLACES, Listener, Places, bind
from support.driven_car import PATIENT, DrivenCar
from support.mock_clock import mock_clock
from support.waiting import DEADLINE_S, until, wait_until

STARTS, KNOCKS = 3, 5
MUCH_BYTES = 10_000_000


def knock(port: int, ended: threading.Event, knocks: list[int]) -> None:
    while not ended.is_set():
        with suppress(OSError), socket.create_connection(("127.0.0.1", port), 0.1):
            knocks.append(port)


def test_a_car_that_ends_while_others_come_loses_none_of_their_connections() -> None:
    for _ in range(STARTS):
        ended, knocks = threading.Event(), []
        with DrivenCar(profile=PATIENT) as car:
            ports = (car.port, car.telemetry_port) * 2
            knockers = [threading.Thread(target=knock, args=(port, ended, knocks)) for port in ports]
            for knocker in knockers:
                knocker.start()
            wait_until(lambda knocks=knocks: len(knocks) >= KNOCKS)
        ended.set()
        for knocker in knockers:
            knocker.join(DEADLINE_S)
        # A connection that nobody closed is warned of here, and warnings are errors.
        gc.collect()


class Standing(asyncio.Protocol):
    """A client that stays."""

    holder = ""
    stays = False

    def __init__(self, made: Callable[[asyncio.BaseTransport], None], closed: Callable[[], None]) -> None:
        self.connection_made = made
        self.connection_lost = lambda _: closed()

    def has_session(self) -> bool:
        return True

    def drop(self) -> None:
        pass


@contextlib.asynccontextmanager
async def listening(
    made: Callable[[asyncio.BaseTransport], None],
    count: int,
    turned_away: Callable[[], None] = lambda: None,
    tls: ssl.SSLContext | None = None,
    places: Places = DRIVE_PLACES,
) -> AsyncIterator[list[socket.socket]]:
    """Accept ``count`` clients that came before, while the block runs."""
    with bind("127.0.0.1", 0) as socket_of_listener, contextlib.ExitStack() as held:
        accepting = Listener(socket_of_listener, partial(Standing, made), turned_away, tls, places)
        clients = [held.enter_context(socket.create_connection(accepting.address)) for _ in range(count)]
        serving = asyncio.ensure_future(accepting.serve())
        async with asyncio.timeout(DEADLINE_S):
            yield clients
        accepting.close_to_newcomers()
        serving.cancel()
        await asyncio.gather(serving, return_exceptions=True)


@pytest.mark.parametrize(
    ("places", "kept"),
    [
        (Places(most=20, most_of_one_address=4), 4),
        (Places(most=20, most_of_one_address=4, burst=2), 8),
        (Places(most=3, most_of_one_address=4, waiting=20), 3),
        (Places(most=6, most_of_one_address=4, waiting=20, burst=2), 6),
    ],
)
def test_connections_are_bounded_in_all_and_of_one_address_though_other_places_are_free(
    places: Places, kept: int
) -> None:
    made, turned_away = [], []

    async def accept() -> None:
        async with listening(made.append, 10, lambda: turned_away.append(True), places=places):
            await until(lambda: len(made) + len(turned_away) == 10)

    asyncio.run(accept())
    assert len(made) == kept


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have 127.0.0.1 alone")
def test_who_has_all_places_of_an_address_takes_none_of_another() -> None:
    """Connections of 127.0.0.1 have sessions here; that of the other address is idle, and stays."""
    ended = []

    class Visitor(Standing):
        def __init__(self, closed: Callable[[], None]) -> None:
            super().__init__(self.begin, closed)
            self.host = ""

        def begin(self, transport: asyncio.BaseTransport) -> None:
            self.host = transport.get_extra_info("peername")[0]

        def has_session(self) -> bool:
            return self.host == "127.0.0.1"

        def drop(self) -> None:
            ended.append(self.host)

    async def accept() -> None:
        turned_away: list[bool] = []
        places = Places(most=20, most_of_one_address=2)
        with bind("127.0.0.1", 0) as bound, contextlib.ExitStack() as held:
            accepting = Listener(bound, Visitor, lambda: turned_away.append(True), None, places)
            serving = asyncio.ensure_future(accepting.serve())
            for host in ("127.0.0.2", *["127.0.0.1"] * 3):
                held.enter_context(socket.create_connection(accepting.address, source_address=(host, 0)))
            await until(lambda: turned_away)
            accepting.close_to_newcomers()
            serving.cancel()
            await asyncio.gather(serving, return_exceptions=True)

    asyncio.run(accept())
    assert ended == []


def test_what_a_client_does_not_read_takes_little_of_the_systems_memory() -> None:
    """What waits there can't be counted, and is old when the client goes on."""

    async def taken_bytes() -> int:
        connected = asyncio.get_running_loop().create_future()
        async with listening(connected.set_result, 1):
            transport = await connected
            transport.write(bytes(MUCH_BYTES))
            return MUCH_BYTES - transport.get_write_buffer_size()

    assert asyncio.run(taken_bytes()) < 100_000


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have other options, or none")
def test_a_peer_that_has_vanished_is_noticed_in_ten_seconds() -> None:
    async def options() -> list[int]:
        connected = asyncio.get_running_loop().create_future()
        async with listening(connected.set_result, 1):
            line = (await connected).get_extra_info("socket")
            return [
                line.getsockopt(*option)
                for option in (
                    (socket.SOL_SOCKET, socket.SO_KEEPALIVE),
                    (socket.IPPROTO_TCP, socket.TCP_KEEPIDLE),
                    (socket.IPPROTO_TCP, socket.TCP_KEEPINTVL),
                    (socket.IPPROTO_TCP, socket.TCP_KEEPCNT),
                )
            ]

    is_on, idle_s, between_s, count = asyncio.run(options())
    assert is_on
    assert 5 <= idle_s + between_s * count <= 10


def test_the_end_of_an_answer_does_not_wait_for_its_beginning_to_be_acknowledged() -> None:
    async def accept() -> int:
        is_prompt = asyncio.get_running_loop().create_future()

        def made(transport: asyncio.BaseTransport) -> None:
            line = transport.get_extra_info("socket")
            is_prompt.set_result(line.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))

        async with listening(made, 1):
            return await is_prompt

    assert asyncio.run(accept())


def test_a_listener_that_ends_leaves_no_task_behind() -> None:
    async def accept() -> None:
        connected = asyncio.Event()
        async with listening(lambda _: connected.set(), 1):
            await connected.wait()
        await until(lambda: asyncio.all_tasks() == {asyncio.current_task()})

    asyncio.run(accept())


def test_open_connections_get_a_turn_between_two_newcomers() -> None:
    turns, turn_of_each = 0, []

    async def accept() -> None:
        loop, all_came = asyncio.get_running_loop(), asyncio.Event()

        def count_turn() -> None:
            nonlocal turns
            turns += 1
            loop.call_soon(count_turn)

        def made(transport: asyncio.BaseTransport) -> None:
            turn_of_each.append(turns)
            if len(turn_of_each) == 12:
                all_came.set()

        async with listening(made, 12):
            count_turn()
            await all_came.wait()

    asyncio.run(accept())
    assert len(set(turn_of_each)) == len(turn_of_each)


def test_a_flood_that_wants_handshakes_does_not_fill_the_queue_in_which_newcomers_wait() -> None:
    """A round of the event loop may last for a handshake, so one newcomer a round is too few."""

    count, rounds, turned_away = 200, 0, []

    async def accept() -> None:
        nonlocal rounds
        tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        async with listening(lambda _: None, count, lambda: turned_away.append(rounds), tls) as clients:
            for client in clients:
                client.sendall(b"nonsense")
            # All are of one address, so most of them are turned away as soon as they are accepted.
            while len(turned_away) < count / 2:
                await asyncio.sleep(0)
                rounds += 1

    asyncio.run(accept())
    assert rounds < count / 4


@pytest.mark.skipif(sys.platform == "win32", reason="its loop doesn't tell whether a client has said anything")
def test_who_says_nothing_where_keys_are_wanted_is_turned_away_and_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(listener, "HANDSHAKE_S", 0.01)
    turned_away = []

    async def accept() -> None:
        tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        async with listening(lambda _: None, 3, lambda: turned_away.append(True), tls) as clients:
            for client in clients:
                client.setblocking(False)
                assert await asyncio.get_running_loop().sock_recv(client, 1) == b""

    asyncio.run(accept())
    assert len(turned_away) == 3


def test_who_has_shown_keys_and_wants_nothing_gives_way_to_a_newcomer_with_keys(keys) -> None:
    made: list[asyncio.BaseTransport] = []
    dropped: list[asyncio.BaseTransport] = []

    class Idle(Standing):
        def __init__(self, closed: Callable[[], None]) -> None:
            super().__init__(self.begin, closed)

        def begin(self, transport: asyncio.BaseTransport) -> None:
            self.transport = transport
            made.append(transport)

        def has_session(self) -> bool:
            return False

        def drop(self) -> None:
            dropped.append(self.transport)
            self.transport.close()

    async def accept() -> None:
        wants_keys, driver = server_context(keys / "car-ada.pem"), client_context(keys / "driver-lin.pem")
        with bind("127.0.0.1", 0) as bound:
            accepting = Listener(bound, Idle, lambda: None, wants_keys, Places(most=2, most_of_one_address=2))
            serving = asyncio.ensure_future(accepting.serve())
            writers = []
            for count in (1, 2, 3):
                writers += (await asyncio.open_connection(*accepting.address, ssl=driver, server_hostname="ada"))[1:]
                await until(lambda count=count: len(made) == count)
            accepting.close_to_newcomers()
            serving.cancel()
            await asyncio.gather(serving, return_exceptions=True)
            accepting.drop_all()
            for writer in writers:
                writer.close()

    asyncio.run(accept())
    assert dropped[0] is made[0]


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have 127.0.0.1 alone")
@pytest.mark.parametrize("leave", [False, True], ids=["stay", "leave"])
def test_a_newcomer_goes_before_many_addresses_whose_handshakes_were_halves(
    monkeypatch: pytest.MonkeyPatch, leave: bool
) -> None:
    """A stranger may have many addresses. How many handshakes begin before the newcomer's is counted, not timed."""
    monkeypatch.setattr(listener, "HANDSHAKE_S", 0.01)
    strangers, begun, over = 40, [], []

    def make(closed: Callable[[], None]) -> Standing:
        begun.append(closed)
        return Standing(lambda _: None, closed)

    async def admit() -> int:
        tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        with bind("127.0.0.1", 0) as bound, contextlib.ExitStack() as held:
            listening = Listener(bound, make, lambda: over.append(True), tls)

            def come(host: str, said: bytes) -> socket.socket:
                client = held.enter_context(socket.create_connection(listening.address, source_address=(host, 0)))
                client.sendall(said)
                return client

            serving = asyncio.ensure_future(listening.serve())
            async with asyncio.timeout(DEADLINE_S):
                for newcomers in ("127.0.0.1", "127.0.0.2"):
                    for number in range(1, strangers + 1):
                        stranger = come(f"127.0.1.{number}", b"\x16")
                        if leave:
                            stranger.close()
                    newcomer = come(newcomers, b"nonsense")
                    begun.clear()
                    newcomer.setblocking(False)
                    while not is_answered(newcomer):
                        await asyncio.sleep(0)
                    before = len(begun)
                    while len(over) % (strangers + 1):
                        await asyncio.sleep(0.001)
            listening.close_to_newcomers()
            serving.cancel()
            await asyncio.gather(serving, return_exceptions=True)
        return before

    assert asyncio.run(admit()) < strangers / 4


def is_answered(client: socket.socket) -> bool:
    """Whether something came, or the other end hung up."""
    try:
        client.recv(1)
    except BlockingIOError:
        return False
    except ConnectionError:
        return True
    return True


@mock_clock
async def test_handshakes_leave_half_of_the_time_to_who_is_connected() -> None:
    """What is computed behind the begin of each takes time, here of a clock that only jumps."""
    clock = asyncio.get_running_loop()
    begun_s: list[float] = []
    cost_s = 0.1

    class Slow(Listener):
        def _accept(self, line: socket.socket, address: str) -> None:
            begun_s.append(clock.time())
            # The loop reads what has come some rounds later.
            clock.call_soon(clock.call_soon, clock.call_soon, clock.jump, cost_s)
            super()._accept(line, address)

    tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    with bind("127.0.0.1", 0) as bound, contextlib.ExitStack() as held:
        slow = Slow(bound, partial(Standing, lambda _: None), lambda: None, tls)
        for _ in range(5):
            held.enter_context(socket.create_connection(slow.address)).sendall(b"\x16")
        serving = asyncio.ensure_future(slow.serve())
        await until(lambda: len(begun_s) == 5)
        slow.close_to_newcomers()
        serving.cancel()
        await asyncio.gather(serving, return_exceptions=True)
        slow.drop_all()
    gaps_s = [later - sooner for sooner, later in pairwise(begun_s)]
    assert min(gaps_s) > 1.9 * cost_s
