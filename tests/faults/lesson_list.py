"""The teacher's list of cars in a simulated lesson: a car of the room is found, shown, stopped, loaded, and let go."""

import asyncio
import base64
from binascii import crc32
from collections.abc import Callable
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, Any

from tests.faults import lesson_teacher
from tests.faults.browsers import DONE
from tests.faults.liars import Opened
from tests.faults.pupils import PASSWORD
from tests.faults.room_cars import BACK_S, PORT, RoomCar, moving_image, multicast
from tests.faults.system import Replaced, Time
from tests.faults.world import here

from motorcade.boards import lines as car_lines
from motorcade.fleet import cars as fleet_cars
from motorcade.fleet import contact as fleet_contact
from motorcade.fleet import link as fleet_link
from motorcade.fleet.places import CAR
from motorcade.upload import serial_port
from motorcade.words.request import GO, STOP

if TYPE_CHECKING:
    from tests.faults.browsers import SimulatedPage
    from tests.faults.lesson import Lesson

_LIST = "teacher/cars"
# What a car near by takes for an order, for an upload, and until a picture of the list shows it.
_ORDER_S, _LOAD_S, _SHOWN_S = 0.5, 6.0, 4.0
_AWAY_S = 1.0


class ListedCar(RoomCar):
    """A car of the room that nobody drives: it does what its program says, until it is stopped."""

    def __init__(self, run: "Lesson") -> None:
        folder = run.disk.path("/cars")
        run.disk.create(folder, True)
        room = SimpleNamespace(
            world=run.world, random=run.random, disk=run.disk, network=run.network, folder=folder, wanted=""
        )
        super().__init__(room, 0)
        self.where = f"{self.host}:{PORT}"

    def is_connected(self) -> bool:
        """Whether anybody is connected to it."""
        links = self.room.network.links.values()
        return any(socket.address == (self.host, PORT) for link in links for socket in link.sockets)


def announced(run: "Lesson") -> dict[str, ModuleType]:
    """How the car is found in the network."""
    return multicast([("a car.", run.listed.host, PORT, CAR)], run.random)


async def list_cars(run: "Lesson") -> None:
    """The teacher opens the list, and does something with the car that is found; then the list is closed."""
    car = run.listed
    car.start()
    page = (await run.teacher.open(_LIST)).follow()
    is_stopped = run.ordered == STOP
    row = await _shown(run, page, lambda row: row["state"] == ("stopped" if is_stopped else row["state"]), BACK_S)
    run.world.keep("found", bool(row), f"the list shows {page.messages[-1:]}")
    known = (car.name, car.number, "leader", "simulated", False)
    told = tuple(row[key] for key in ("name", "number", "role", "board", "away"))
    run.world.keep("found", told == known, f"{told} in place of {known}")
    if is_stopped:
        run.world.keep("stop-holds", car.is_halted, "a car that is found later isn't stopped")
    for act in run.random.sample((_stop_and_go, _load, _nonsense, _stop_all, _blink), 2):
        await act(run, page)
    await _check_row(run, page)
    if run.random.random() < 0.3:
        await _of_who_signs_out(run)
    page.close()
    await asyncio.sleep(_AWAY_S)
    run.world.keep("bounded", not car.is_connected(), "the server stays connected to a car that no page shows")
    assert car.process
    car.process.end()
    car.speed = 0


async def _shown(
    run: "Lesson", page: "SimulatedPage", is_so: Callable[[dict[str, Any]], bool], within_s: float = _SHOWN_S
) -> dict[str, Any]:
    """The car's row, once it shows something; what it shows last where it never does."""
    end_s = run.world.now_s + within_s
    row: dict[str, Any] = {}
    while run.world.now_s < end_s and not (row and row["state"] and not row["away"] and is_so(row)):
        await asyncio.sleep(0.1)
        rows = (page.newest("cars") or {}).get("cars", [])
        row = next((row for row in rows if row["where"] == run.listed.where), {})
    return row


async def _check_row(run: "Lesson", page: "SimulatedPage") -> None:
    """What the list shows of a car with which nothing is done, whole; and nothing else is in the list."""
    car, state = run.listed, "stopped" if run.listed.is_halted else "runs"
    row = await _shown(run, page, lambda row: row["state"] == state)
    image = car.holds()
    known: dict[str, Any] = {
        "name": car.name,
        "where": car.where,
        "kind": "car",
        "number": car.number,
        "role": "leader",
        "board": "simulated",
        "version": row.get("version"),
        "state": state,
        "words": len(image) // 4,
        "crc32": f"{crc32(image):08x}",
        "battery_mv": row.get("battery_mv"),
        "away": False,
        "silent_s": None,
        "program": run.loaded.get(crc32(image), ""),
        "problem": None,
        "sent": None,
        "error": None,
        "holds": row.get("holds"),
    }
    run.world.keep("shows-what-is", row == known, "the list shows {}, not {}", row, known)
    is_known = row["holds"] == ("new" if known["program"] else "") or not known["program"]
    run.world.keep("shows-what-is", is_known, "what was loaded now is shown as {}", row)
    shown = page.newest("cars") or {}
    told = len(shown["cars"]), shown["others"], shown["problem"]
    run.world.keep("shows-what-is", told == (1, [], None), "the list of cars has {}", told)


async def _obeys(run: "Lesson", order: str) -> None:
    """The car has done an order by now."""
    run.ordered = order
    await asyncio.sleep(_ORDER_S)
    is_halted = run.listed.is_halted
    run.world.keep("stop-gets-through", is_halted == (order == STOP), f"after {order} the car is halted: {is_halted}")


async def _stop_and_go(run: "Lesson", page: "SimulatedPage") -> None:
    page.send({"do": "stop"})
    await _obeys(run, STOP)
    # The list follows within a quarter of a second.
    row = await _shown(run, page, lambda row: row["state"] == "stopped", 0.2)
    run.world.keep("shows-what-is", row["state"] == "stopped", f"a car that is stopped is shown as {row['state']}")
    page.send({"do": "go"})
    await _obeys(run, GO)


async def _stop_all(run: "Lesson", page: "SimulatedPage") -> None:
    """The teacher's stop is for these cars, too, and so is the release."""
    for _ in range(run.random.choice((1, 2))):
        await lesson_teacher.stop(run)
        await _obeys(run, run.ordered)


async def _blink(run: "Lesson", page: "SimulatedPage") -> None:
    errors = len(page.codes())
    page.send({"do": "blink", "where": [run.listed.where]})
    await asyncio.sleep(1.0)
    run.world.keep("as-asked", len(page.codes()) == errors, f"a car that is there can't blink: {page.codes()}")


async def _load(run: "Lesson", page: "SimulatedPage") -> None:
    """A program is loaded: the car holds it, the list says so, and a stopped car stays stopped."""
    image = moving_image(run.random)
    run.listed.known.add(image)
    text = base64.b64encode(image).decode()
    page.send({"do": "load", "where": [run.listed.where], "image": text, "program": "Parade\u202e"})
    crc32_of = f"{crc32(image):08x}"
    row = await _shown(run, page, lambda row: row["holds"] == "new" and row["crc32"] == crc32_of, _LOAD_S)
    run.world.keep("verified", row["holds"] == "new", f"a healthy car isn't loaded: {row}")
    run.world.keep("verified", run.listed.holds() == image, "the car holds another program")
    run.world.keep("shows-what-is", row["crc32"] == crc32_of, f"the list shows {row['crc32']}")
    run.world.keep("safe-text", row["program"] == "Parade", f"the list shows {row['program']!r}")
    run.loaded = {crc32(image): "Parade"}
    if run.ordered == STOP:
        run.world.keep("stop-holds", run.listed.is_halted, "a stopped car drives with a new program")


async def _nonsense(run: "Lesson", page: "SimulatedPage") -> None:
    """What is wrong gives a sentence, changes nothing, and ends nothing."""
    before = run.listed.holds()
    where = [run.listed.where]
    for order in (
        {"do": "blink", "where": ["nobody"]},
        {"do": "load", "where": where, "image": "AAAA"},
        {"do": "load", "where": ["spy:///dev/null?file=/tmp/x"], "image": base64.b64encode(before).decode()},
        {"do": "explode"},
    ):
        page.send(order)
    await asyncio.sleep(1.0)
    codes = page.codes()[-4:]
    run.world.keep("says-why", len(codes) == 4 and not page.has_ended, f"nonsense gives {codes}")
    run.world.keep("verified", run.listed.holds() == before, "nonsense has loaded a car")


async def _of_who_signs_out(run: "Lesson") -> None:
    """The list of a teacher who signs out ends."""
    other = run.new_browser()
    await run.expect("right-guess", other, "teacher/sign-in", DONE, password=PASSWORD)
    run.signed_in.append(other)
    page = (await other.open(_LIST)).follow()
    await asyncio.sleep(0.5)
    run.world.keep("shows-what-is", bool(page.newest("cars")), "a second list shows nothing")
    kept = dict(other.cookies)
    await run.expect("as-asked", other, "teacher/sign-out", DONE)
    run.signed_in.remove(other)
    other.cookies = kept
    await asyncio.sleep(1.0)
    run.world.keep("out-is-out", page.has_ended, "a teacher who has signed out sees the cars")


def names(run: "Lesson") -> Replaced:
    """What the modules take from the system."""
    return {
        (fleet_cars, "monotonic"): Time.monotonic,
        (fleet_contact, "monotonic"): Time.monotonic,
        (fleet_link, "monotonic"): Time.monotonic,
        (fleet_link, "monotonic_ms"): lambda: int(Time.monotonic() * 1000),
        (fleet_link, "secrets"): SimpleNamespace(randbelow=run.random.randrange),
        (fleet_cars, "ports"): list,
        (serial_port, "serial"): Opened(),
        (car_lines, "listen"): lambda host, port: run.network.listen(here(), host, port),
    }


ACTS = [(0.6, list_cars)]
