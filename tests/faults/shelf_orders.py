"""Cars of a shelf are found, shown, named, stopped and let go."""

import asyncio
from binascii import crc32
from typing import TYPE_CHECKING, Any

from tests.faults.shelf_cars import PORT, ShelfCar, ShelfDriveCar

from motorcade.errors import MotorcadeError
from motorcade.fleet.cars import ALL, Cars
from motorcade.fleet.places import CAR, CLASS, DRIVE, STUDIO, Place, network_place
from motorcade.words.packing import WORD_BYTES
from motorcade.words.request import ASK, BLINK, GO, NAME, STOP

if TYPE_CHECKING:
    from tests.faults.shelf import Shelf

# What an order to a car near by takes, and until one that is off, or back, is known to be.
_ORDER_S, _BACK_S, _AWAY_S, _LEAST_AWAY_S = 0.2, 4.0, 5.2, 2.5
# For so long a network carries nothing; an order comes so soon to a car that waits for its next try.
_LOST_S, _SOON_S, _FAR_S = 4.0, 0.5, 0.2
_BAD_NAMES = ("", "all", "ALL", "a b", "x" * 33, "a\n")


def listed(car: ShelfCar | ShelfDriveCar, name: str = "") -> Any:
    """The place of a car in a list."""
    is_drive = isinstance(car, ShelfDriveCar)
    return network_place(car.host, car.port, name, DRIVE if is_drive else CAR)


def row(fleet: Cars, car: ShelfCar | ShelfDriveCar) -> Any:
    """What the table shows of a car; None where it shows nothing."""
    rows = [status for status in fleet.statuses() if status.where == car.where]
    return rows[0] if len(rows) == 1 else None


async def table(run: "Shelf") -> None:
    """The table has what each car says of itself, and says in time which one answers no more, and which one again."""
    cars = [run.car() for _ in range(run.random.randint(2, 4))]
    cars[0].talks = run.random.random() < 0.5
    for car in cars[1:]:
        run.announce(car, CAR)
    driven = run.drive_car()
    run.announce(driven, run.random.choice((DRIVE, CLASS, CAR)))
    # Its telemetry isn't at the next port.
    other = run.drive_car(telemetry=6006)
    run.announced.append(("a class.", "10.5.0.1", 7710, CLASS))
    async with run.fleet([listed(cars[0])]) as fleet:
        # Somebody announces it otherwise, and first.
        for kind, telemetry in ((CAR, 0), (DRIVE, 0), (DRIVE, other.telemetry)):
            fleet.add(network_place(other.host, other.port, "", kind, telemetry)._replace(found=True))
        await asyncio.sleep(6.0)
        for car in cars:
            _compare(run, fleet, car)
        for server in (driven, other):
            shown = row(fleet, server)
            known = shown and (shown.kind, shown.state, shown.battery_mv, shown.away)
            run.keep("found", known == ("drive", "ready", server.mv, False), f"a drive server is shown as {shown}")
        run.keep("found", len(fleet.statuses()) == len(cars) + 2, f"{fleet.statuses()}")
        run.keep("found", fleet.problem is None, "the list isn't whole, though all were asked")
        assert run.finder
        others = [place.address for place in run.finder.others.values() if place.host == "10.5.0.1"]
        run.keep("found", others == ["10.5.0.1:7710"], f"of a class the list has {others}")
        names = [status.name for status in fleet.statuses()]
        run.keep("found", names == sorted(names), f"the table has {names} in this order")
        lost = run.random.choice(cars)
        ends = run.random.random() < 0.5
        lost.is_mute = not ends
        if ends:
            lost.end()
        else:
            await asyncio.sleep(_LEAST_AWAY_S)
            run.keep("found", not row(fleet, lost).away, "a car is away that missed one heartbeat")
        await asyncio.sleep(_AWAY_S)
        shown = row(fleet, lost)
        run.keep("found", shown is not None and shown.away, f"a car that answers no more is shown as {shown}")
        run.keep("found", shown.silent_s >= 3.0, f"it is silent for {shown.silent_s} s")
        for car in [car for car in cars if car is not lost]:
            _compare(run, fleet, car)
        lost.is_mute, lost.name, lost.battery_mv = False, "again", 5000
        if ends:
            lost.start()
        await asyncio.sleep(_BACK_S + 5.0)
        _compare(run, fleet, lost)


def _compare(run: "Shelf", fleet: Cars, car: ShelfCar) -> None:
    shown = row(fleet, car)
    run.keep("found", shown is not None, f"{car.where} isn't in the table")
    told = (*shown[:11], shown.away, shown.problem)
    known: tuple[Any, ...] = (car.name, car.where, "car", car.number, car.role, car.board, car.version, car.state)
    known += (len(car.held) // WORD_BYTES, f"{crc32(car.held):08x}", car.battery_mv, False, None)
    run.keep("found", told == known, f"{told} in place of {known}")


async def order(run: "Shelf") -> None:
    """A stop and its end reach all cars: named, found, drive servers, and those that come later, before all else."""
    named, found, off = run.car(), run.car(), run.car(starts=False)
    deaf = run.car()
    deaf.ignores_orders = True
    driven, found_driven = run.drive_car(), run.drive_car()
    run.announce(found, CAR)
    run.announce(found_driven, run.random.choice((DRIVE, STUDIO)))
    async with run.fleet([listed(named), listed(off), listed(driven), listed(deaf)]) as fleet:
        await asyncio.sleep(2.0)
        for kind in run.random.choice(((STOP, GO), (STOP, STOP, GO, STOP), (GO, STOP, GO))):
            begin_s = run.world.now_s
            fleet.order(kind)
            await asyncio.sleep(_ORDER_S)
            for car in (named, found, deaf):
                # A heartbeat may have been on its way.
                kinds = [asked for asked in car.kinds(begin_s) if asked != ASK]
                run.keep("stop-gets-through", kinds[:1] == [kind], f"{car.where} gets {kinds} in place of {kind}")
            for server in (driven, found_driven):
                is_right = (server.state == "stopped") == (kind == STOP)
                run.keep("stop-gets-through", is_right, f"{server.where} is {server.state} after {kind}")
            missing = {status.where for status in await fleet.confirmed(1.0)}
            run.keep("away-first", missing == {off.where, deaf.where}, f"{missing} haven't confirmed {kind}")
            last = kind
        await _come_later(run, fleet, off, deaf, last)


async def _come_later(run: "Shelf", fleet: Cars, off: ShelfCar, deaf: ShelfCar, last: str) -> None:
    late, found_later, driven = run.car(), run.car(), run.drive_car()
    off.start()
    fleet.add(listed(late))
    fleet.add(listed(found_later)._replace(found=True))
    fleet.add(listed(driven)._replace(found=True))
    await asyncio.sleep(_BACK_S)
    for car in (off, late, found_later):
        run.keep("away-first", car.kinds()[:1] == [last], f"{car.where} gets {car.kinds()[:3]} before {last}")
    is_right = (driven.state == "stopped") == (last == STOP)
    run.keep("away-first", is_right, f"a drive server that is found later is {driven.state} after {last}")
    again = deaf.kinds().count(last)
    run.keep("away-first", again > 1, f"an order that isn't confirmed is sent {again} times")
    deaf.ignores_orders = False
    missing = await fleet.confirmed(_BACK_S)
    run.keep("away-first", not missing, f"{missing} haven't confirmed {last}")
    begin_s = run.world.now_s
    await asyncio.sleep(_BACK_S)
    kinds = set(off.kinds(begin_s))
    run.keep("away-first", kinds == {"a"}, f"a car that has confirmed its order gets {kinds}")


async def order_the_lost(run: "Shelf") -> None:
    """An order that was lost with its connection isn't confirmed, and reaches its car as soon as that is back."""
    found, driven, other = run.car(starts=False), run.drive_car(), run.drive_car()
    run.announce(found, CAR)
    link = run.network.link(f"people to {driven.host}", 0.003)
    async with run.fleet([listed(driven), listed(other)]) as fleet:
        # Who doesn't answer is asked ever less often.
        await asyncio.sleep(run.random.uniform(5.0, 12.0))
        found.start()
        await asyncio.sleep(0.05)
        link.stall(_LOST_S)
        kind = run.random.choice((STOP, STOP, GO))
        fleet.order(kind)
        await asyncio.sleep(_SOON_S)
        kinds = [asked for asked in found.kinds() if asked != ASK]
        run.keep("stop-gets-through", kinds[:1] == [kind], f"a car that is back gets {kinds}, though {kind} is ordered")
        driven.end()
        await asyncio.sleep(_LOST_S + 1.0)
        missing = [status.where for status in await fleet.confirmed(0.5)]
        run.keep(
            "away-first", missing == [driven.where], f"{missing} haven't confirmed {kind}, and {driven.where} is off"
        )
        driven.start()
        await asyncio.sleep(_BACK_S)
        is_right = (driven.state == "stopped") == (kind == STOP)
        run.keep("away-first", is_right, f"a drive server that is back is {driven.state} after {kind}")


async def order_in_flight(run: "Shelf") -> None:
    """An answer confirms its own order alone: a car whose power fails before the next one gets that when it is back."""
    car = run.car()
    run.network.link(f"people to {car.host}", _FAR_S)
    async with run.fleet([listed(car)]) as fleet:
        await asyncio.sleep(2.0)
        first, then = run.random.choice(((GO, STOP), (STOP, STOP), (STOP, GO)))
        fleet.order(first)
        # The first one has come, and its answer is on its way. The next one is on its way when the power fails.
        await asyncio.sleep(_FAR_S * 1.5)
        fleet.order(then)
        await asyncio.sleep(_FAR_S * 0.9)
        kinds = [asked for asked in car.kinds() if asked != ASK]
        car.end()
        missing = [status.where for status in await fleet.confirmed(_LOST_S)]
        run.keep("away-first", missing == [car.where], f"{kinds} came, and {then} is lost, but {missing} miss an order")
        begin_s = run.world.now_s
        car.start()
        await asyncio.sleep(_BACK_S)
        kinds = [asked for asked in car.kinds(begin_s) if asked != ASK]
        run.keep("stop-gets-through", kinds[:1] == [then], f"a car that is back gets {kinds}, though {then} is ordered")


async def name_them(run: "Shelf") -> None:
    """A name means one car, that of the list first; what is announced is none; requests reach whom they name."""
    twins = [run.car("twin"), run.car("twin")]
    other, written = run.car("other"), run.car("zoe")
    for car in twins:
        run.announce(car, CAR)
    run.announce(other, CAR)
    driven = run.drive_car()
    silent = network_place("10.9.9.9", PORT, "silent")
    async with run.fleet([listed(written, "other"), listed(driven, "truck"), silent]) as fleet:
        await asyncio.sleep(2.0)
        begin_s = run.world.now_s
        await _refused(run, fleet, "name-of-two-cars", "twin")
        for nobody in ("nobody", "all cars", f"{other.host}.2.", "10.0.0.99:7001"):
            await _refused(run, fleet, "no-such-car", nobody)
        await _refused(run, fleet, "car-only-drives", "truck")
        await _refused(run, fleet, "no-car-at-address", "silent")
        (found,) = fleet.named(["other"])
        run.keep("safe-text", found.place.address == written.where, f"the list's name means {found.place}")
        where = {contact.place.address for contact in fleet.named([ALL])}
        wanted = {silent.address, *(car.where for car in (*twins, other, written))}
        run.keep("found", where == wanted, f"all are {where} in place of {wanted}")
        await fleet.ask([twins[0].where, "zoe"], BLINK)
        for car in (*twins, other, written):
            blinks = car.kinds(begin_s).count(BLINK)
            run.keep("found", blinks == (car in (twins[0], written)), f"{car.where} blinks {blinks} times")
        for bad in run.random.sample(_BAD_NAMES, 2):
            await _refused(run, fleet, "bad-car-name", "zoe", NAME, bad)
        # A car that keeps no name says so.
        written.refuses = {NAME: "name-not-kept", BLINK: "no light"}
        await _refused(run, fleet, "car-keeps-no-name", "zoe", NAME, "ada")
        await _refused(run, fleet, "car-refuses", "zoe")
        written.refuses = {}
        written.asked.clear()
        await fleet.ask([written.where], NAME, "ada")
        names = [name for kind, name, _ in written.asked if kind == NAME]
        run.keep("found", names == ["ada"], f"a car is given the names {names}")


async def _refused(run: "Shelf", fleet: Cars, code: str, name: str, kind: str = BLINK, new: str = "") -> None:
    try:
        await fleet.ask([name], kind, new)
    except MotorcadeError as problem:
        run.keep("found", problem.code == code, f"{name!r}: {problem.code} in place of {code}")
    else:
        run.keep("found", False, f"{name!r} is asked {kind} {new!r}")


async def crowd(run: "Shelf") -> None:
    """Whoever announces more than is kept hides no car that answers, nor one of another host; and that is said."""
    from tests.faults.shelf import MOST_FOUND

    cars = [run.car() for _ in range(4)]
    for car in cars[:2]:
        run.announce(car, CAR)
    kind = run.random.choice((CAR, DRIVE, CLASS))
    async with run.fleet() as fleet:
        await asyncio.sleep(2.0)
        run.keep("found", fleet.problem is None, "the list isn't whole, though all were asked")
        fewer = run.random.random() < 0.4
        count = MOST_FOUND - 4 if fewer else 2 * MOST_FOUND
        hosts = ["10.8.0.1"] if run.random.random() < 0.6 else [f"10.8.0.{number}" for number in range(count)]
        # Nobody answers there, and nobody says so: a try takes its whole time.
        for host in hosts:
            run.network.link(f"people to {host}", 0.002).down_until_s = 1e9
        for number in range(count):
            host = hosts[number % len(hosts)]
            fleet.add(network_place(host, 1000 + number, "", kind)._replace(found=True))
        run.keep("found", fleet.problem is not None, "the list is said to be whole, though nobody has asked")
        for car in cars[2:]:
            fleet.add(listed(car)._replace(found=True))
        begin_s = run.world.now_s
        fleet.order(GO)
        await fleet.confirmed(0.3)
        waited_s = run.world.now_s - begin_s
        run.keep("away-first", waited_s >= 0.3, "all are said to have confirmed an order, though some weren't asked")
        if len(hosts) == 1 or fewer:
            begin_s = run.world.now_s
            await asyncio.sleep(6.0)
            slow = [car.where for car in cars[2:] if row(fleet, car) is None or row(fleet, car).away]
            run.keep("found", not slow, f"{slow}, of other hosts, are not asked for {run.world.now_s - begin_s} s")
        for car in cars[:2]:
            shown = row(fleet, car)
            run.keep("found", shown is not None and not shown.away, f"{car.where}, which has answered, is {shown}")
        fleet.order(STOP)
        await asyncio.sleep(_ORDER_S)
        drives = [car.where for car in cars[:2] if car.state != "stopped"]
        run.keep("stop-gets-through", not drives, f"{drives} drive after a stop")
        await asyncio.sleep(30.0)
        is_whole = fleet.problem is None
        run.keep("found", is_whole == fewer, f"with {count} more, the list is said to be whole: {is_whole}")
        for host in hosts:
            del run.network.links[f"people to {host}"]


async def share_a_host(run: "Shelf") -> None:
    """Many cars of one computer stay, whoever else announces how much; all are stopped."""
    from tests.faults.shelf import MOST_FOUND

    host = run.new_host()
    cars = [run.car(host=host, port=PORT + number) for number in range(6)]
    for car in cars:
        run.announce(car, CAR)
    async with run.fleet() as fleet:
        await asyncio.sleep(1.0)
        for number in range(MOST_FOUND + 8):
            fleet.add(network_place(f"10.6.0.{number}", PORT, "", CAR)._replace(found=True))
        await asyncio.sleep(3.0)
        run.keep("found", fleet.problem is not None, "the list is said to be whole, though some were left out")
        for car in cars:
            _compare(run, fleet, car)
        fleet.order(STOP)
        await asyncio.sleep(_ORDER_S)
        states = [car.state for car in cars]
        run.keep("stop-gets-through", states == ["stopped"] * len(cars), f"cars of one computer: {states}")


async def strange(run: "Shelf") -> None:
    """What answers something else is no car: it keeps its words for itself, and is asked seldom."""
    car, odd = run.car(), run.car("odd")
    kind = run.random.choice(("lines", "other-number", "stranger"))
    odd.answer = {  # type: ignore[method-assign]
        "lines": lambda request: b"tick\n" * 50,
        "other-number": lambda request: ShelfCar.answer(odd, request._replace(number=f"{_behind(request.number):02x}")),
        "stranger": lambda request: b"HTTP/1.1 400 Bad Request\r\n\r\n",
    }[kind]
    named = run.random.random() < 0.5
    if not named:
        run.announce(odd, CAR)
    async with run.fleet([listed(car), *([listed(odd)] if named else [])]) as fleet:
        begin_s = run.world.now_s
        await asyncio.sleep(20.0)
        shown = row(fleet, odd)
        run.keep("found", shown is None or shown.away, f"what answers no request is shown as {shown}")
        name = shown.name if shown else odd.where
        run.keep("found", name != "odd", "an answer to no request names a car")
        _compare(run, fleet, car)
        count = len(odd.kinds(begin_s))
        run.keep("work-bounded", count <= (6 if kind == "lines" else 30), f"it is asked {count} times in 20 s")
        run.keep("nobody-waits", 12 <= len(car.kinds(begin_s)) <= 16, f"a car is asked {len(car.kinds(begin_s))} times")


def _behind(number: str) -> int:
    return int(number, 16) + 128 & 255


async def forget(run: "Shelf") -> None:
    """What somebody named stays, whatever is withdrawn; what is named and found is one car."""
    from tests.faults.shelf import MOST_NAMED

    car, found = run.car(), run.car()
    run.announce(car, CAR)
    run.announce(found, CAR)
    place = listed(car, "mine")
    if run.random.random() < 0.5:
        # By a name of its host.
        run.network.names["mine.local"] = car.host
        place = network_place("mine.local", PORT, "mine")
    async with run.fleet([place]) as fleet:
        await asyncio.sleep(1.0)
        rows = [status.where for status in fleet.statuses()]
        run.keep("found", sorted(rows) == sorted([place.address, found.where]), f"the table has {rows}")
        fleet.remove(place.address)
        await asyncio.sleep(0.5)
        (kept,) = fleet.named(["mine"])
        run.keep("found", kept.place.address == place.address, "a car that somebody named is forgotten")
        # So many places, and no more, may be named.
        for number in range(MOST_NAMED - 1):
            fleet.add(network_place("10.7.0.1", 3000 + number))
        run.keep("found", fleet.problem is None, "the list isn't whole, though all that was named is in it")
        fleet.add(network_place("10.7.0.1", 2999))
        run.keep("found", fleet.problem is not None, "the list is said to be whole, though some were left out")


async def plug_in(run: "Shelf") -> None:
    """A car at a cable is shown while it is plugged in, also one that says something when it starts.

    A device that sends by itself gets no byte, and what a prompt shows of a question is erased again: neither is a car.
    """
    car, loud, prompt = (run.car(host=f"/dev/ttyUSB{number}") for number in range(3))
    car.chatter_s, loud.chatter_s, prompt.shows = run.random.choice((0.0, 0.8)), 1e9, True
    named = run.random.random() < 0.3
    if not named:
        run.plugged = [car.host]
    async with run.fleet([Place(car.host, "mine")] if named else []) as fleet:
        await asyncio.sleep(4.0)
        if not named:
            _compare(run, fleet, car)
        run.plugged = [car.host, loud.host, prompt.host]
        await asyncio.sleep(6.0)
        run.keep("found", loud.came == b"", f"a device that sends by itself gets {loud.came[:60]!r}")
        text = prompt.came.replace(b"\x7f", b"")[4:]
        erased = prompt.came.count(b"\x7f")
        run.keep("found", 0 < len(text) <= erased, f"of {text!r}, which a prompt shows, {erased} signs are erased")
        rows = [status.where for status in fleet.statuses()]
        run.keep("found", rows == [car.where], f"the table has {rows}")
        came = prompt.came
        run.plugged = []
        await asyncio.sleep(6.0)
        run.keep("found", prompt.came == came, "a device that is no car is asked again")
        run.keep("found", len(car.lines) == named, f"a port that was pulled out is opened {len(car.lines)} times")
        rows = [status.where for status in fleet.statuses()]
        run.keep("found", rows == [car.where] * named, f"without a cable the table has {rows}")
        run.plugged = [car.host]
        await asyncio.sleep(5.0)
        run.keep("found", len(car.lines) == 1, f"a port that is back is opened {len(car.lines)} times")
        (found,) = fleet.named([car.host])
        await fleet.ask([car.host], BLINK)
        run.keep(
            "found", not found.status().away and BLINK in car.kinds(), "a car that is plugged in again isn't asked"
        )


async def hang(run: "Shelf") -> None:
    """A car at a cable that hangs stays in the table, and so does a board that only murmurs at first.

    Either may be reset: then it is shown, and gets the last order.
    """
    car, other = (run.car(host=f"/dev/ttyUSB{number}") for number in range(2))
    other.is_mute, other.murmur = True, b"it starts\n"
    run.plugged = [car.host, other.host]
    async with run.fleet() as fleet:
        await asyncio.sleep(4.0)
        _compare(run, fleet, car)
        car.is_mute = car.ignores_orders = other.ignores_orders = True
        fleet.order(STOP)
        await asyncio.sleep(run.random.choice((5.5, 20.0)))
        shown = row(fleet, car)
        code = shown.problem.code if shown and shown.problem else None
        run.keep("found", code == "car-away" and shown.away, f"a car at a cable that hangs is shown as {shown}")
        car.is_mute = car.ignores_orders = other.is_mute = other.ignores_orders = False
        await asyncio.sleep(9.0)
        for back in (car, other):
            run.keep("away-first", back.state == "stopped", f"{back.where} was reset, and misses an order")
            _compare(run, fleet, back)


async def ask_the_lost(run: "Shelf") -> None:
    """Whoever asks a car whose connection breaks is told so at once, and one that is mute after a while."""
    car = run.car()
    async with run.fleet([network_place(car.host, car.port)]) as fleet:
        car.is_mute, breaks = True, run.random.random() < 0.6
        car.hangs_up_at = BLINK if breaks else ""
        begin_s, code = run.world.now_s, ""
        try:
            await fleet.ask([car.where], BLINK)
        except MotorcadeError as problem:
            code = problem.code
        took_s = run.world.now_s - begin_s
        run.keep("nobody-waits", code == "car-away", f"who asks a car that is lost is told {code!r}")
        run.keep("nobody-waits", (took_s < 1.0) == breaks and took_s < 6.0, f"who asks a lost car waits {took_s:.1f} s")


async def come_late(run: "Shelf") -> None:
    """A car that was announced, and is switched on much later, is found within a few seconds."""
    car, other = run.car(starts=False), run.car()
    run.announce(car, CAR)
    run.announce(other, CAR)
    async with run.fleet(within_s=2.0) as fleet:
        await asyncio.sleep(run.random.choice((10.0, 80.0)))
        shown = row(fleet, car)
        run.keep("found", shown is not None and shown.away, f"a car that was announced and is off is shown as {shown}")
        begin_s = run.world.now_s
        car.start()
        while run.world.now_s < begin_s + 12.0 and (row(fleet, car) is None or row(fleet, car).away):
            await asyncio.sleep(0.2)
        _compare(run, fleet, car)
        _compare(run, fleet, other)


ACTS = (
    table,
    order,
    order_the_lost,
    order_in_flight,
    name_them,
    crowd,
    share_a_host,
    strange,
    forget,
    plug_in,
    hang,
    ask_the_lost,
    come_late,
)
