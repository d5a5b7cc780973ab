"""A computer uploads to one car of a shelf and reads it back: what it says is what the car holds."""

import asyncio
from pathlib import Path
from typing import TYPE_CHECKING

from tests.faults.shelf_cars import BAUD, CHECK_FAULTS, IMAGE_FAULTS
from tests.faults.uploads import drawn_image

from motorcade.errors import MotorcadeError, Phrase
from motorcade.upload import serial_port
from motorcade.upload.transfer import SENDS_AGAIN
from motorcade.words.packing import WORD_BYTES

if TYPE_CHECKING:
    from tests.faults.shelf import Shelf
    from tests.faults.shelf_cars import ShelfCar

_TRIES = 3
# What a car does in each try, what is said then, and what it holds.
_REASONS = (
    ("mute", "no-answer-at-address", "old"),
    ("other-checksum", "mismatch", "old"),
    ("refuses", "mismatch", "old"),
    ("cant-store", "refused", "old"),
    ("too-large", "refused", "old"),
    ("busy", "car-busy", ""),
    ("stores-hangs-up", "connection-broke", "either"),
    ("other-uploader", "no-answer-at-address", "neither"),
    ("last-answer", "no-answer-at-address", "either"),
)
# The same of a car that knows no check requests: what it does with the images, the last of them again and again; what
# is said; and what it holds, where it refuses such requests, and where it takes them for a program.
_OLD_REASONS = (
    (("mute",), "no-answer-at-address", ("unknown", "unknown")),
    (("refuses",), "mismatch", ("old", "neither")),
    (("cant-store",), "refused", ("old", "neither")),
    (("too-large",), "refused", ("old", "neither")),
    (("other-checksum",), "mismatch", ("neither", "neither")),
    (("other-checksum", "cant-store"), "refused", ("neither", "neither")),
    (("mute", "cant-store"), "refused", ("unknown", "unknown")),
    (("stores-hangs-up",), "connection-broke", ("unknown", "unknown")),
)
# Another upload will change what the car has; or what answers shows itself as something else.
_UNHELD = ("car-busy", "runs-something-else")
# So long a board sends when it starts.
_STARTS_S = 1.0
# So long an upload may take to a quiet, healthy car.
_QUICK_S = 1.4
# So long an upload may take that fails in all its tries.
_MOST_S = 40.0


async def upload(run: "Shelf") -> None:
    """Whatever a car does with a program, what is said of it is true; and it is tried again while that helps."""
    for _ in range(3):
        car = run.car()
        car.knows_no_checks, car.takes_requests = run.random.random() < 0.4, run.random.random() < 0.5
        if run.random.random() < 0.5:
            car.checks = [run.random.choice(CHECK_FAULTS) for _ in range(run.random.randint(0, 3))]
        car.images = [run.random.choice(IMAGE_FAULTS) for _ in range(run.random.randint(0, 3))]
        # A board says something when it starts. One that never stops sending gets the upload nevertheless.
        car.chatter_s = run.random.choice((0.0, 0.0, _STARTS_S, 1e9))
        await _upload(run, car)
        car.checks.clear()
        car.images.clear()
        image, begin_s = drawn_image(run.random), run.world.now_s
        again: list[Phrase] = []
        await run.in_thread(
            lambda image=image, again=again: serial_port.upload("port", image, BAUD, retrying=again.append)
        )
        run.keep("goes-on", car.held == image, "a healthy car isn't loaded")
        is_sent_once = SENDS_AGAIN not in [retry.key for retry in again] or car.chatter_s > 0
        run.keep("goes-on", is_sent_once, "a healthy car is sent a program twice")
        is_quick = run.world.now_s - begin_s < _QUICK_S or car.knows_no_checks or car.chatter_s > 0
        run.keep("upload-ends", is_quick, f"a healthy car is loaded in {run.world.now_s - begin_s:.1f} s")
        is_calm = car.chatter_s != _STARTS_S or not car.was_disturbed
        run.keep("upload-ends", is_calm, "an upload begins while a board is starting")
        car.end()


async def _upload(run: "Shelf", car: "ShelfCar") -> None:
    image, faults = drawn_image(run.random), (list(car.checks), list(car.images))
    steps: list[int] = []
    retries: list[Phrase] = []
    begin_s = run.world.now_s
    try:
        await run.in_thread(
            lambda: serial_port.upload("port", image, BAUD, progress=steps.append, retrying=retries.append)
        )
        told = "new"
    except MotorcadeError as problem:
        phrase = problem.details.get("holds")
        told = phrase.key.removeprefix("car-holds-") if phrase else ""
        run.keep("says-why", bool(problem.sentence("zh")), problem.code)
        run.keep("says-what-it-holds", bool(phrase) or problem.code in _UNHELD, f"{faults}: {problem}")
    run.keep("upload-ends", run.world.now_s - begin_s < _MOST_S, f"behind {faults}: {run.world.now_s - begin_s:.0f} s")
    if not faults[0] and len(faults[1]) < _TRIES and set(faults[1]) <= {"mute", "hangs-up", "same-length"}:
        is_new = told == "new" or "hangs-up" in faults[1]
        run.keep("verified", is_new, f"behind {faults}, tried {len(retries) + 1} times: {told}")
    holds = {"new": car.held == image, "old": car.held == car.first, "neither": car.held not in (image, car.first)}
    run.keep("says-what-it-holds", holds.get(told, True), f"behind {faults}: {told}")
    wholes = steps.count(len(image))
    run.keep("shows-what-is", wholes <= len(retries) + 1, f"of {len(image)} bytes these were sent: {steps}")
    if told == "new":
        run.keep("shows-what-is", steps[-1:] == [len(image)], f"of {len(image)} bytes these were sent: {steps}")
    run.keep("shows-what-is", max(steps, default=0) <= len(image), f"of {len(image)} bytes these were sent: {steps}")


async def say_why(run: "Shelf") -> None:
    """What a car does again and again is what is said, and what it holds; what is no car is called by its name."""
    car = run.car()
    image = drawn_image(run.random)
    while len(image) == WORD_BYTES:
        image = drawn_image(run.random)
    for fault, code, holds in run.random.sample(_REASONS, 4):
        car.images, car.checks, car.held = [fault] * 9, [], car.first
        if fault == "busy":
            car.checks = [fault] * 9
        if fault == "last-answer":
            # It stores the image, and a bridge says again and again what it said before.
            car.checks, car.images = ["", *[fault] * 9], ["stores-mute"] * 9
        retries = await _fail(run, image, fault, (code, holds))
        is_final = fault in ("cant-store", "too-large")
        run.keep("upload-ends", not (is_final and retries), f"behind {fault} it is tried again: {retries}")
    car.knows_no_checks, car.checks = True, []
    for faults, code, old_holds in run.random.sample(_OLD_REASONS, 3):
        car.takes_requests = run.random.random() < 0.5
        car.images, car.held = [*faults, *faults[-1:] * 9], car.first
        await _fail(run, image, " and ".join(faults), (code, old_holds[car.takes_requests]))
    car.end()


async def _fail(run: "Shelf", image: bytes, fault: str, wanted: tuple[str, str]) -> list[Phrase]:
    """Upload to a car at which that fails; return how it was tried again. ``wanted``: the code, and what it holds."""
    retries: list[Phrase] = []
    try:
        await run.in_thread(lambda: serial_port.upload("socket://car:7001", image, BAUD, retrying=retries.append))
    except MotorcadeError as problem:
        phrase = problem.details.get("holds")
        told = problem.code, phrase.key.removeprefix("car-holds-") if phrase else ""
        run.keep("says-why", told == wanted, f"{fault}: {told} in place of {wanted}")
    else:
        run.keep("verified", False, f"an upload succeeds behind {fault}")
    return retries


async def no_answer(run: "Shelf") -> None:
    """Without an answer nothing is verified; nobody says that a car holds what it may not."""
    car, image = run.car(), drawn_image(run.random)
    car.checks, car.images = ["mute"] * 9, ["mute"] * 9
    said = await run.in_thread(lambda: serial_port.upload("port", image, BAUD, verify=False))
    run.keep("verified", "verified" in said and "not" in said, said)
    run.keep("verified", car.got == len(image), f"{car.got} of {len(image)} bytes are sent without a check")
    for old in (False, True):
        car.knows_no_checks, car.images = old, ["mute"] * 9
        try:
            await run.in_thread(lambda: serial_port.upload("port", image, BAUD))
        except MotorcadeError as problem:
            run.keep("verified", problem.code == "no-answer", problem.code)
        else:
            run.keep("verified", False, "an upload to a mute car succeeds")
    car.end()
    await asyncio.sleep(0.1)


async def read_back(run: "Shelf") -> None:
    """What is read back is what the car holds, or nothing."""
    car = run.car()
    car.images = [run.random.choice(("damages", "mute")) for _ in range(run.random.randint(0, 4))]
    faults = list(car.images)
    try:
        image = await run.in_thread(lambda: serial_port.readback("port", BAUD))
    except MotorcadeError as problem:
        run.keep("verified", len(faults) >= _TRIES, f"behind {faults}: {problem}")
    else:
        run.keep("verified", image == car.held, f"behind {faults} an image is read that the car doesn't hold")
    car.end()


async def files(run: "Shelf") -> None:
    """No file is a port, whoever names it; a port is this program's alone while it is open."""
    car = run.car()
    for port in (__file__, str(Path(__file__).parent), "/dev/null/x", "socket://", "rfc2217://car:7001", ""):
        for act in (lambda: serial_port.readback(port, BAUD), lambda: serial_port.upload(port, car.first, BAUD)):  # noqa: B023
            try:
                await run.in_thread(act)
            except MotorcadeError as problem:
                run.keep("says-why", bool(problem.sentence("zh")), problem.code)
            else:
                # A name that doesn't exist may be a device; what opens it answers.
                run.keep("only-ports", port == "/dev/null/x", f"{port} is a port")
    car.end()


ACTS = (upload, say_why, no_answer, read_back, files)
