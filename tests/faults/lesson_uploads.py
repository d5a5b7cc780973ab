"""Uploads in a simulated lesson: who has the cable uploads through it, and all into simulated cars and own ports."""

import asyncio
import base64
import json
from typing import TYPE_CHECKING

from tests.faults.browsers import DONE
from tests.faults.lesson_work import IMAGE, SERIAL

from motorcade.server.studio.library import OWNERS, folder_of
from motorcade.server.studio.uploads import VIRTUAL_CAR

if TYPE_CHECKING:
    from tests.faults.lesson import Lesson


async def upload(run: "Lesson") -> None:
    """Who hasn't the cable uploads nothing through it; while pages are frozen nobody does."""
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    run.frozen = run.random.random() < 0.3
    await run.expect("as-asked", run.teacher, "teacher/freeze", DONE, frozen=run.frozen)
    port = run.random.choice((SERIAL.port, "virtual", "spy:///dev/ttyTEST?file=/tmp/x", "/dev/other", "socket://a:1"))
    page = (await pupil.browser.open("upload")).follow()
    page.send({"port": port, "image": IMAGE, "profile": "classroom"})
    await asyncio.sleep(2.0)
    told = json.dumps(page.messages)
    page.close()
    may = port == "virtual" or run.holders[""] is pupil
    if run.frozen:
        run.world.keep("one-holder", "class-frozen" in told, f"an upload while all is frozen: {told[:200]}")
    elif port == "virtual":
        run.world.keep("verified", '"verified"' in told, f"no upload into the simulated car: {told[-200:]}")
        folder = run.folder / OWNERS / folder_of(pupil.id)
        held = run.disk.find(folder / VIRTUAL_CAR).data
        run.world.keep("verified", held.startswith(base64.b64decode(IMAGE)), "the simulated car holds another image")
    elif not may:
        run.world.keep("one-holder", "cable-of-another" in told, f"{port} without the cable: {told[:200]}")
    elif port not in ("virtual", SERIAL.port):
        run.world.keep("one-holder", "no-such-port" in told, f"{port} of a page: {told[:200]}")


async def late_upload(run: "Lesson") -> None:
    """Who has lost the cable while the upload waited for its turn uploads nothing through it."""
    pupil = run.draw(run.pupils)
    if pupil is None or run.frozen or run.loop is None:
        return
    await run.expect("one-holder", run.teacher, "teacher/pass-on", DONE, name="", pupil=pupil.id)
    run.loop.late_s = 1.0
    page = (await pupil.browser.open("upload")).follow()
    page.send({"port": SERIAL.port, "image": IMAGE, "profile": "classroom"})
    await asyncio.sleep(0.2)
    run.loop.late_s = 0.0
    await run.expect("one-holder", run.teacher, "teacher/pass-on", DONE, name="", pupil=None)
    run.holders[""] = None
    await asyncio.sleep(1.5)
    told = json.dumps(page.messages)
    page.close()
    run.world.keep("one-holder", "cable-of-another" in told, f"an upload without the cable: {told[:200]}")


async def upload_by_own_port(run: "Lesson") -> None:
    """A pupil uploads through a port of the browser's: the page gets a program's bytes; a port that closes ends it."""
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    page = (await pupil.browser.open("serial")).follow()
    page.send({"port": "", "image": IMAGE, "profile": "classroom"})
    await asyncio.sleep(2.0)
    run.world.keep("as-asked", page.pictures > 0, f"no bytes for the port: {page.messages[-1:]}")
    # A port that closes, or a page that says something else.
    page.send({})
    await asyncio.sleep(1.0)
    last = page.messages[-1] if page.messages else {}
    is_failed = page.has_ended and last.get("outcome") == "failed"
    run.world.keep("says-why", is_failed, f"an upload whose port closes goes on: {last}")


ACTS = [
    (0.6, upload),
    (0.3, upload_by_own_port),
    (0.5, late_upload),
]
