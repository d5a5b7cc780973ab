"""A real car and simulated worlds in a lesson: who drives, who is stopped, whose world is whose."""

import asyncio
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from tests.faults.browsers import DONE, Browser, SimulatedPage
from tests.faults.keys import PROFILE, CountingBoard
from tests.faults.lesson_doors import MISSION
from tests.faults.lesson_work import IMAGE
from tests.faults.loop import SimulatedLoop
from tests.faults.system import THREADS, Replaced
from tests.faults.world import Process

from motorcade.drive import client as drive_client
from motorcade.drive import server as drive_server
from motorcade.drive import session as drive_session
from motorcade.drive.channels import Clients
from motorcade.drive.server import serving, watched
from motorcade.drive.session import CarControl
from motorcade.drive.stamps import stamp_at
from motorcade.service.messages import MissionChoice
from motorcade.service.missions import chosen_mission
from motorcade.timing import to_ticks
from motorcade.words.request import GO

if TYPE_CHECKING:
    from tests.faults.lesson import Lesson, Pupil

CAR = "red"
_PORT = 5005
# The car's loop is looked at so often: half of the time after which it counts as stuck.
_BEAT_MS = 100
# A car that somebody may drive no more stands so soon: two periods of telemetry, and the way to it.
_STANDS_S = 0.5
_PERIOD_S = 0.05
# A world is kept for a minute without a page; a place at a car for five seconds without use.
_FORGOTTEN_S, _UNUSED_S = 63.0, 6.0
_PLACES = 9
_IN_TURN = 3
_MAT = {
    "format": "motorcade-mat/1",
    "name": "a table",
    "tick_ms": 5,
    "car": [{"at_m": [0, 0], "role": "leader"}, {"at_m": [0.5, 0]}],
}
SET = {"do": "set", "image": IMAGE, "mat": _MAT, "profile": "classroom", "seed": 1}
_OTHER_SEED = 77
_TEACHERS_KEY = "f" * 32
# Their sentences fill all that lies between the server and a page.
_MANY_ERRORS = 300


def start_car(run: "Lesson") -> None:
    """Start the drive server of the class's car."""
    process = run.car = Process(run.world, "car", 0.001)
    loop = SimulatedLoop(process, run.network)
    run.board = CountingBoard()

    async def serve() -> None:
        control = run.control = CarControl(run.board, lambda: to_ticks(loop.time()), PROFILE)
        sockets: list[Any] = [run.network.listen(process, "car", port) for port in (_PORT, _PORT + 1)]
        async with watched(control), serving(Clients(control), *sockets):
            await asyncio.Event().wait()

    loop.run(serve)


class LessonRemotePage:
    """A page that drives the car; ``number`` is that of its last position of the stick."""

    def __init__(self, run: "Lesson", page: SimulatedPage) -> None:
        self._run, self.page = run, page
        self.number = 0
        page.send({"do": "join", "car": CAR})

    def _stamp(self) -> int:
        return stamp_at(int(self._run.world.now_s * 1000))

    async def hold(self, throttle: float, seconds: float) -> None:
        """Hold the stick for a time, as a page does: it also answers the server's clock."""
        end_s = self._run.world.now_s + seconds
        while self._run.world.now_s < end_s:
            self.number += 1
            told = self.page.newest("telemetry")
            if told and told.get("clock") is not None:
                self.page.send({"do": "sync", "clock": told["clock"], "number": self.number, "stamp": self._stamp()})
            stick = {"cars": [CAR], "throttle": throttle, "steering": 0.0, "switches": {}}
            self.page.send({"do": "drive", "number": self.number, "stamp": self._stamp()} | stick)
            await asyncio.sleep(_PERIOD_S)


async def opened(run: "Lesson", browser: Browser, name: str = "Mia") -> LessonRemotePage:
    """A page of the remote."""
    page = (await browser.open(f"/drive/ws?name={quote(name)}" if name else "/drive/ws")).follow()
    run.world.keep("as-asked", not page.refused, f"the remote is refused: {page.refused}")
    return LessonRemotePage(run, page)


def may_drive(run: "Lesson", pupil: "Pupil") -> bool:
    return run.holders[CAR] is pupil and not run.stopped and not run.frozen


async def hand_over(run: "Lesson", pupil: "Pupil") -> None:
    """The teacher lets a pupil drive the car now."""
    if run.frozen:
        await run.expect("as-asked", run.teacher, "teacher/freeze", DONE, frozen=False)
    if run.stopped or run.car_is_stopped:
        await run.expect("as-asked", run.teacher, "teacher/release-all", DONE)
        run.ordered = GO
    await run.expect("one-holder", run.teacher, "teacher/pass-on", DONE, name=CAR, pupil=pupil.id)
    run.frozen = run.stopped = run.car_is_stopped = False
    run.holders[CAR] = pupil


async def drive(run: "Lesson") -> None:
    """A pupil drives: only who has the car, while nothing is stopped or frozen."""
    pupil = run.draw(run.pupils)
    if pupil is None or run.control is None:
        return
    if run.random.random() < 0.6:
        await hand_over(run, pupil)
    remote, may = await opened(run, pupil.browser), may_drive(run, pupil)
    before = run.board.moves
    await remote.hold(0.0, 0.5)
    await remote.hold(0.6, 1.5)
    moved = run.board.moves > before
    if not may:
        run.world.keep("one-holder", not moved, f"{pupil.name} drives without the car")
        codes = remote.page.codes()
        run.world.keep("one-holder", "not-your-turn" in codes, f"{pupil.name} is told {codes}")
    elif not run.car_is_stopped:
        run.world.keep(
            "drives-again", moved, f"{pupil.name}, who has the car, can't drive: {remote.page.messages[-1:]}"
        )
        await _take_away(run, pupil, remote)
    remote.page.close()
    await asyncio.sleep(_STANDS_S)
    run.world.keep("gone-stops", run.board.speed == 0, "the car drives without a page")


async def _take_away(run: "Lesson", pupil: "Pupil", remote: LessonRemotePage) -> None:
    """Whoever may drive no more stands still, though the stick is held."""
    from tests.faults import lesson_teacher

    acts = [lesson_teacher.freeze, lesson_teacher.stop, lesson_teacher.pass_on, _stop_by_another, _let_go]
    act = run.random.choice(acts)
    # The stick is held until after the act, so that something has to stop the wheels.
    holding = asyncio.create_task(remote.hold(0.6, 3.0))
    await asyncio.sleep(0.1)
    await act(run)
    await asyncio.sleep(_STANDS_S)
    if not may_drive(run, pupil) or run.car_is_stopped:
        run.world.keep("one-holder", run.board.speed == 0, f"{pupil.name} still drives after {act.__name__}")
        moves = run.board.moves
        await asyncio.sleep(0.5)
        run.world.keep("stop-holds", run.board.moves == moves, f"{pupil.name} drives on after {act.__name__}")
    holding.cancel()


async def _let_go(run: "Lesson") -> None:
    """The pupil gives the car back."""
    pupil = run.holders[CAR]
    if pupil:
        await run.expect("one-holder", pupil.browser, "class/take", DONE, name=CAR, wants=False)
        run.holders[CAR] = None


async def _stop_by_another(run: "Lesson") -> None:
    """Every pupil may stop a car at any time, also one who hasn't it; lifting the stop is for who has it."""
    pupil = run.draw(run.pupils)
    if pupil is None or run.control is None:
        return
    page = (await pupil.browser.open("/drive/ws")).follow()
    leaves_at_once = run.random.random() < 0.3
    page.send({"do": "stop", "cars": [CAR]})
    if leaves_at_once:
        page.close()
    await asyncio.sleep(_STANDS_S)
    state = run.control.telemetry().state
    run.world.keep("stop-gets-through", state == "stopped", f"{pupil.name}'s stop: the car is {state}")
    run.car_is_stopped = True
    if leaves_at_once:
        return
    page.send({"do": "join", "car": CAR})
    await asyncio.sleep(0.5)
    page.send({"do": "clear", "car": CAR})
    await asyncio.sleep(0.5)
    state, may = run.control.telemetry().state, may_drive(run, pupil)
    run.world.keep("stop-holds", (state != "stopped") == may, f"{pupil.name} has lifted the stop: {state}, {may}")
    run.car_is_stopped = state == "stopped"
    page.close()


async def drive_in_turn(run: "Lesson") -> None:
    """The car goes round: each who has it drives at once, though those of before still hold their sticks."""
    if run.control is None:
        return
    holding, pages = [], []
    for pupil in run.random.sample(run.pupils, min(_IN_TURN, len(run.pupils))):
        await hand_over(run, pupil)
        remote = await opened(run, pupil.browser, pupil.name)
        moves = run.board.moves
        await remote.hold(0.0, run.random.uniform(0.5, 0.6))
        await remote.hold(0.6, 0.5)
        run.world.keep("drives-again", run.board.moves > moves, f"{pupil.name}, who has the car now, can't drive")
        pages.append(remote.page)
        holding.append(asyncio.create_task(remote.hold(0.6, 9.0)))
    for each in holding:
        each.cancel()
    for page in pages:
        page.close()
    await asyncio.sleep(_STANDS_S)
    run.world.keep("gone-stops", run.board.speed == 0, "the car drives without a page")


async def stop_car(run: "Lesson") -> None:
    """Somebody stops the car."""
    await _stop_by_another(run)


async def many_pages(run: "Lesson") -> None:
    """All places at a car are taken: one more page gets none at first, stops the car all the same, gets one later."""
    if run.control is None:
        return
    await asyncio.sleep(1.0)
    pages = [await opened(run, run.teacher, f"T{number}") for number in range(_PLACES)]
    await asyncio.sleep(0.5)
    late = (await run.teacher.open("/drive/ws?name=late")).follow()
    late.send({"do": "join", "car": CAR})
    await asyncio.sleep(0.5)
    run.world.keep("bounded", late.codes() == ["full"], f"a tenth page at a car is told {late.codes()}")
    late.send({"do": "stop", "cars": [CAR]})
    await asyncio.sleep(_STANDS_S)
    state = run.control.telemetry().state
    run.world.keep("stop-gets-through", state == "stopped", f"with all places taken a stopped car is {state}")
    run.car_is_stopped = True
    await asyncio.sleep(_UNUSED_S)
    late.send({"do": "join", "car": CAR})
    await asyncio.sleep(1.0)
    shown = (late.newest("telemetry") or {}).get("cars", {}).get(CAR, {})
    run.world.keep("nobody-waits", shown.get("state") == "stopped", f"nobody uses the car, and a page sees {shown}")
    for page in [late, *(remote.page for remote in pages)]:
        page.close()
    await asyncio.sleep(0.5)


async def lift_the_teachers_stop(run: "Lesson") -> None:
    """Who has the car can't lift the stop of the teacher."""
    from tests.faults import lesson_teacher

    pupil = run.draw(run.pupils)
    if pupil is None or run.control is None:
        return
    await hand_over(run, pupil)
    await lesson_teacher.stop(run)
    page = (await pupil.browser.open("/drive/ws")).follow()
    page.send({"do": "join", "car": CAR})
    await asyncio.sleep(0.5)
    page.send({"do": "clear", "car": CAR})
    await asyncio.sleep(0.5)
    state = run.control.telemetry().state
    run.world.keep("stop-holds", state == "stopped", f"{pupil.name} has lifted the teacher's stop: {state}")
    page.close()


async def late_sticks(run: "Lesson") -> None:
    """A stick's positions that come late move nothing."""
    pupil = run.draw(run.pupils)
    if pupil is None or run.control is None:
        return
    await hand_over(run, pupil)
    remote = await opened(run, pupil.browser)
    await remote.hold(0.0, 0.6)
    await remote.hold(0.5, 0.5)
    await _overtake(run, remote)
    now_ms = int(run.world.now_s * 1000)
    await asyncio.sleep(0.6)
    run.world.keep("stands-in-time", run.board.speed == 0, "the car drives on without a position")
    moves = run.board.moves
    for number in range(5):
        stick = {"cars": [CAR], "throttle": 0.9, "steering": 0.0, "switches": {}}
        remote.page.send({"do": "drive", "number": 900 + number, "stamp": stamp_at(now_ms + number)} | stick)
    await asyncio.sleep(0.4)
    run.world.keep("no-old-command", run.board.moves == moves, "positions that are 0.6 s old move the car")
    stale = [each for each in remote.page.messages if each.get("is") == "received" and each.get("stale")]
    run.world.keep("no-old-command", bool(stale), "the page isn't told that its positions are old")
    remote.page.close()


async def _overtake(run: "Lesson", remote: LessonRemotePage) -> None:
    """A position that is overtaken moves nothing, however fresh it is."""
    speed = run.board.speed
    run.world.keep("drives-again", speed > 0, "a pupil who has the car can't drive")
    stick = {"cars": [CAR], "throttle": 0.9, "steering": 0.0, "switches": {}}
    remote.page.send({"do": "drive", "number": 1, "stamp": stamp_at(int(run.world.now_s * 1000))} | stick)
    for _ in range(10):
        await asyncio.sleep(0.02)
        run.world.keep("no-old-command", run.board.speed in (speed, 0), "a position that was overtaken moves the car")


# Worlds.


def key_of(pupil: "Pupil", number: int = 0) -> str:
    return f"{int(pupil.id):x}{number:x}".rjust(32, "0")


def world_of_mission(mission: str = MISSION) -> dict[str, Any]:
    """What a page sends that opens a mission."""
    return SET | {"mission": {"id": mission}, "mat": chosen_mission(MissionChoice(id=mission)).mat_document}


async def play(run: "Lesson") -> None:
    """A pupil plays a world; others can't take it over, and the teacher looks on."""
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    other = run.draw([each for each in run.pupils if each is not pupil])
    page = (await pupil.browser.open(f"world?session={key_of(pupil)}")).follow()
    mission = run.random.random() < 0.3
    page.send(world_of_mission() if mission else SET)
    pupil.opened = MISSION if mission else None
    await asyncio.sleep(0.3)
    hello = page.newest("hello")
    run.world.keep("as-asked", bool(hello and hello.get("cars")), f"no world: {page.messages[-2:]}")
    page.send({"do": "play", "speed": 1.0})
    shown = asyncio.create_task(draw(page))
    await asyncio.sleep(0.4)
    if run.frozen:
        run.world.keep(
            "one-holder", "class-frozen" in page.codes(), f"a world plays while all is frozen: {page.codes()}"
        )
    else:
        state = page.newest("state") or {}
        run.world.keep("as-asked", bool(page.pictures), f"no pictures: {state}")
        await _freeze_world(run, page)
    if other:
        await _look_from_outside(run, pupil, other)
    if run.random.random() < 0.3:
        # A pupil has one world, which the newest page shows.
        newer = (await pupil.browser.open(f"world?session={key_of(pupil, 1)}")).follow()
        await asyncio.sleep(0.3)
        run.world.keep("bounded", "taken-over" in page.codes(), f"a pupil has two worlds: {page.codes()}")
        newer.close()
    shown.cancel()
    page.close()
    if run.random.random() < 0.1:
        await asyncio.sleep(_FORGOTTEN_S)
        outcome, _ = await pupil.browser.fetch("GET", f"/api/world/{key_of(pupil)}/timeline.csv")
        run.world.keep("bounded", outcome == "no-world", f"a world is kept without a page: {outcome}")


async def take_over(run: "Lesson") -> None:
    """A newer page shows a world; the page of before, which reads nothing, isn't gone yet, and does nothing in it."""
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    path = f"world?session={key_of(pupil)}"
    before = await pupil.browser.open(path)
    before.send(SET)
    pupil.opened = None
    before.stop_reading()
    for _ in range(_MANY_ERRORS):
        before.send({"do": "nonsense"})
    await asyncio.sleep(0.3)
    newer = (await pupil.browser.open(path)).follow()
    await asyncio.sleep(0.3)
    before.send({"do": "reset", "seed": _OTHER_SEED})
    await asyncio.sleep(0.3)
    newer.send({"do": "pause"})
    await asyncio.sleep(0.3)
    seed = (newer.newest("state") or {}).get("seed")
    run.world.keep("one-holder", seed == SET["seed"], "the page of before acts in a world: its seed is {}", seed)
    for wanted in (_OTHER_SEED, _OTHER_SEED + 1):
        newer.send({"do": "reset", "seed": wanted})
        await asyncio.sleep(0.3)
        seed = (newer.newest("state") or {}).get("seed")
        run.world.keep("as-asked", seed == wanted, "the newer page has no world: its seed is {}", seed)
        # That the page of before leaves at last is nothing to it.
        before.close()
        await asyncio.sleep(0.3)
    newer.close()


async def draw(page: SimulatedPage) -> None:
    """Tell the server that each picture is drawn."""
    drawn = 0
    while True:
        if page.pictures > drawn:
            drawn = page.pictures
            page.send({"do": "shown", "frame": drawn})
        await asyncio.sleep(0.05)


async def _freeze_world(run: "Lesson", page: SimulatedPage) -> None:
    if run.random.random() < 0.4:
        own = (await run.teacher.open(f"world?session={_TEACHERS_KEY}")).follow()
        own.send(SET)
        own.send({"do": "play", "speed": 1.0})
        await run.expect("as-asked", run.teacher, "teacher/freeze", DONE, frozen=True)
        await asyncio.sleep(0.4)
        pictures, drawn = page.pictures, asyncio.create_task(draw(own))
        await asyncio.sleep(0.4)
        run.world.keep("one-holder", page.pictures - pictures <= 1, "a world goes on while all is frozen")
        run.world.keep("as-asked", bool((own.newest("state") or {}).get("playing")), "the teacher's world is paused")
        drawn.cancel()
        own.close()
        page.send({"do": "step", "ticks": 5})
        await asyncio.sleep(0.2)
        run.world.keep("one-holder", "class-frozen" in page.codes(), "a step while all is frozen")
        await run.expect("as-asked", run.teacher, "teacher/freeze", DONE, frozen=False)


async def _look_from_outside(run: "Lesson", pupil: "Pupil", other: "Pupil") -> None:
    key = key_of(pupil)
    page = (await other.browser.open(f"world?session={key}")).follow()
    await asyncio.sleep(0.2)
    run.world.keep("own-work", "bad-session" in page.codes(), f"{other.name} takes over a world: {page.messages}")
    page.close()
    outcome, _ = await other.browser.fetch("GET", f"/api/world/{key}/timeline.csv")
    run.world.keep("own-work", outcome == "no-world", f"{other.name} gets the timeline of {pupil.name}: {outcome}")
    outcome, data = await pupil.browser.fetch("GET", f"/api/world/{key}/timeline.csv")
    run.world.keep("as-asked", outcome == DONE and data.startswith(b"t_ms"), f"no timeline: {outcome} {data[:40]!r}")
    own = (await run.teacher.open(f"world?session={_TEACHERS_KEY}")).follow()
    own.send(SET)
    watching = (await run.teacher.open(f"teacher/watch?pupil={pupil.id}")).follow()
    nobody = (await run.teacher.open(f"teacher/watch?pupil={other.id}")).follow()
    wall = (await run.teacher.open("teacher/wall")).follow()
    await asyncio.sleep(1.5)
    shared = [""] if run.mat == "running" else []
    for page, known in ((watching, [pupil.id]), (nobody, []), (wall, [pupil.id, *shared])):
        worlds = [each["pupil"] for each in (page.newest("wall") or {"worlds": [{"pupil": None}]})["worlds"]]
        run.world.keep("shows-what-is", worlds == known, f"the worlds of {worlds} are shown, not those of {known}")
    run.world.keep("shows-what-is", watching.pictures > 0 and not nobody.pictures, "the teacher sees another world")
    for page in (own, watching, nobody, wall):
        page.close()


def names(run: "Lesson") -> Replaced:
    return {
        (drive_session, "threading"): THREADS,
        (drive_server, "threading"): THREADS,
        (drive_server, "_BEAT_MS"): _BEAT_MS,
        (drive_client, "random"): SimpleNamespace(uniform=run.random.uniform),
    }


ACTS = [
    (1.4, drive),
    (0.7, drive_in_turn),
    (0.6, stop_car),
    (0.15, many_pages),
    (0.5, lift_the_teachers_stop),
    (0.6, late_sticks),
    (0.8, play),
    (0.5, take_over),
]
