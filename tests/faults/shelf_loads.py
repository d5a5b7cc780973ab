"""Cars of a shelf are loaded side by side: each verdict is true, and nobody else gets anything."""

import asyncio
from binascii import crc32
from collections import defaultdict
from typing import TYPE_CHECKING

from tests.faults.shelf_cars import IMAGE_FAULTS, PORT
from tests.faults.shelf_orders import listed
from tests.faults.uploads import drawn_image

from motorcade.fleet.cars import ALL, Cars
from motorcade.fleet.contact import AWAY, Contact, Verdict
from motorcade.fleet.places import network_place
from motorcade.upload.transfer import EITHER, NEITHER, NEW, OLD, UNKNOWN

if TYPE_CHECKING:
    from tests.faults.shelf import Shelf
    from tests.faults.shelf_cars import ShelfCar

_LOAD_S, _OFF_S, _TRIES = 4.0, 30.0, 3


async def load(run: "Shelf") -> None:
    """Who is named gets the program, whatever becomes of the others; each verdict says what its car holds."""
    good, other, bad, off = run.car(), run.car(), run.car(), run.car()
    driven = run.drive_car()
    # It is connected, and answers nothing.
    mute = run.car()
    mute.is_mute = True
    silent = network_place("10.9.9.8", PORT, "silent")
    places = [*map(listed, (good, other, bad, off, mute)), listed(driven), silent]
    async with run.fleet(places) as fleet:
        await asyncio.sleep(0.5)
        off.end()
        bad.images = _faults(run)
        if run.random.random() < 0.3:
            # It may hold the program already, and says nothing when it is tried again.
            bad.images, bad.checks = ["stores-hangs-up"] * (_TRIES + 1), ["", *["mute"] * 9]
        faults = list(bad.images)
        image = drawn_image(run.random)
        sent: dict[str, list[int]] = defaultdict(list)

        def advance(contact: Contact, count: int) -> None:
            sent[contact.place.address].append(count)

        await asyncio.sleep(6.0)
        begin_s = run.world.now_s
        names = [good.where, bad.where, off.where, mute.where, driven.where, silent.address]
        # Who is named twice is loaded once.
        loading = asyncio.create_task(fleet.load(image, [*names, good.where], advance))
        await asyncio.sleep(_LOAD_S)
        run.keep("nobody-waits", good.held == image, "a healthy car waits for others")
        verdicts = {verdict.where: verdict for verdict in await loading}
        took_s = run.world.now_s - begin_s
        run.keep("nobody-waits", took_s < _OFF_S, f"the load takes {took_s:.0f} s")
        run.keep("verified", sorted(verdicts) == sorted(names), f"{list(verdicts)}")
        told = {where: (verdicts[where].holds, verdicts[where].error is None) for where in names}
        wanted = {good.where: (NEW, True), off.where: (AWAY, False), silent.address: (AWAY, False)}
        wanted |= {mute.where: (AWAY, False)}
        wanted |= {driven.where: (OLD, False)}
        shown = {where: told[where] for where in wanted}
        run.keep("verified", shown == wanted, f"{shown} in place of {wanted}")
        run.keep("verified", other.held == other.first and other.got == 0, "a car that nobody named gets something")
        run.keep("nobody-waits", mute.got == 0, "a car that answers nothing gets an upload")
        steps = sent[good.where]
        is_whole = steps == sorted(steps) and steps[-1:] == [len(image)]
        run.keep("shows-what-is", is_whole, f"of {len(image)} bytes these are said to be sent: {steps}")
        _check(run, bad, verdicts[bad.where], image, faults)
        await asyncio.sleep(3.0)
        await _load_again(run, fleet, good, image)


def _faults(run: "Shelf") -> list[str]:
    kinds = [fault for fault in IMAGE_FAULTS if fault not in ("same-length", "too-large")]
    return [run.random.choice(kinds)] * run.random.randint(1, 4)


def _check(run: "Shelf", car: "ShelfCar", verdict: Verdict, image: bytes, faults: list[str]) -> None:
    """What is said of a car that fails is true; where it fails fewer times than it is tried, it is loaded."""
    may = {NEW: car.held == image, OLD: car.held == car.first, NEITHER: car.held not in (image, car.first)}
    is_true = may.get(verdict.holds, verdict.holds in (EITHER, UNKNOWN))
    run.keep("says-what-it-holds", is_true, f"behind {faults}: {verdict.holds}")
    run.keep("verified", (verdict.error is None) == (verdict.holds == NEW), f"behind {faults}: {verdict}")
    if len(faults) < _TRIES and faults[0] != "cant-store":
        run.keep("verified", verdict.holds == NEW, f"a car that failed {faults} isn't loaded: {verdict}")
    if verdict.error:
        text = verdict.error.sentence()
        run.keep("says-what-it-holds", "car" in text.lower(), text)


async def _load_again(run: "Shelf", fleet: Cars, car: "ShelfCar", image: bytes) -> None:
    """Who has a program already needn't get it again; who is away is told to be away, whatever it held."""
    got = car.got
    (verdict,) = await fleet.load(image, [car.where], skips=f"{crc32(image):08x}")
    run.keep("verified", (verdict.holds, verdict.error) == (NEW, None), f"{verdict}")
    run.keep("nobody-waits", car.got == got, "a car gets a program that it has")
    car.end()
    await asyncio.sleep(6.0)
    (verdict,) = await fleet.load(image, [car.where], skips=f"{crc32(image):08x}")
    run.keep("verified", verdict.holds == AWAY, f"a car that is off is said to hold a program: {verdict}")


async def load_all(run: "Shelf") -> None:
    """All that take programs are loaded, also those that were found; a busy car says so, and is tried again."""
    cars = [run.car() for _ in range(3)]
    run.announce(cars[0], "car")
    driven = run.drive_car()
    async with run.fleet([*map(listed, cars[1:]), listed(driven)]) as fleet:
        await asyncio.sleep(1.0)
        image = drawn_image(run.random)
        tries = run.random.choice((1, 2, 9))
        cars[1].checks = ["busy"] * tries
        restarting = asyncio.create_task(_restart_busy(run, cars[1]))
        verdicts = {verdict.where: verdict for verdict in await fleet.load(image, [ALL])}
        run.keep("verified", set(verdicts) == {car.where for car in cars}, f"{list(verdicts)} are all cars")
        wanted = [True, tries < _TRIES, True]
        run.keep("verified", [car.held == image for car in cars] == wanted, f"with {tries} times busy: {verdicts}")
        holds = [verdicts[car.where].error is None for car in cars]
        run.keep("verified", holds == wanted, f"with {tries} times busy: {verdicts}")
        restarting.cancel()


async def _restart_busy(run: "Shelf", car: "ShelfCar") -> None:
    """Perhaps switch a car off when it has said that it is busy, and on again some seconds later."""
    if run.random.random() < 0.8:
        busy = len(car.checks)
        while len(car.checks) == busy:
            await asyncio.sleep(0.1)
        car.end()
        await asyncio.sleep(3.0)
        car.start()


ACTS = (load, load_all)
