"""Who drives the car of a quiet room, by which commands, and who stops it."""

import asyncio
from collections import Counter

from tests.faults.track_car import (
    COMMANDS,
    FAILSAFE_S,
    HAND_OVER_S,
    HEAD_LIGHT,
    HORN,
    MOVE,
    NEUTRAL,
    OWN_S,
    STALE_S,
    SWITCH,
    TELEMETRY,
    Track,
    TrackBoard,
    TrackClient,
    move,
)

_RATE, _WINDOW_S = 10, 0.1
_SILENCE_S, _ANSWER_S, _ROUND_S = 4.0, 1.0, 2047 * 0.004
_BELIEVED_S, _HALF_MINUTE_S = 0.05, 30.0


async def drive(run: Track) -> None:
    """A driver drives: the wheels and the telemetry have each command, and nothing turns when none comes."""
    stamped = run.random.random() < 0.5
    async with run.car() as board:
        driver = await run.client().come(stamped)
        for _ in range(6):
            setpoint = run.setpoint()
            driver.send(move(setpoint), stamped=stamped)
            await driver.arrive()
            run.keep("sent", board.setpoint == setpoint, f"{board.setpoint} in place of {setpoint}")
        await _read_telemetry(run, driver, stamped)
        # What comes together: the newest counts.
        first, second, last = run.setpoint(), run.setpoint(), run.setpoint()
        before = len(board.applied)
        driver.send(move(first), move(second), SWITCH, move(last), stamped=stamped)
        await driver.arrive()
        came = [setpoint for setpoint, _ in board.applied[before:]]
        run.keep("sent", came == [last], f"of {first}, {second} and {last} the wheels got {came}")
        await _fall_silent(run, board, driver, stamped)


async def _read_telemetry(run: Track, driver: TrackClient, stamped: bool) -> None:
    """Telemetry says what the car does now."""
    setpoint = await run.drive_on(driver, 0.3, stamped)
    applied = len(run.board.applied)
    end_s = run.world.now_s + 0.25
    while run.world.now_s < end_s:
        driver.send(move(setpoint), stamped=stamped)
        await asyncio.sleep(0.05)
    told = driver.told
    shown = told["state"], (told["angle_deg"], told["direction"], told["speed"]), told["driver"], told["watchers"]
    run.keep("shows-what-is", shown == ("moving", setpoint, driver.name, 0), f"{shown}, though {setpoint} is applied")
    run.keep("shows-what-is", told["age_ms"] <= 80, f"the last command came {told['age_ms']} ms ago")
    run.keep("shows-what-is", driver.you["drives"] and not driver.you["waits"], driver.you)
    counted = driver.you["applied"]
    run.keep("shows-what-is", applied < counted <= len(run.board.applied) + 3, f"{counted} of {applied} are counted")
    gaps = [later - before for before, later in zip(driver.told_s[-4:], driver.told_s[-3:], strict=False)]
    run.keep("shows-what-is", all(0.05 < gap < 0.15 for gap in gaps), f"telemetry comes every {gaps} s")
    run.keep("logged", ("drives", driver.name) in run.records, f"{run.records}")


async def _fall_silent(run: Track, board: TrackBoard, driver: TrackClient, stamped: bool) -> None:
    """Without a command the wheels stop in time, not before; then speed 0 has to come before a speed."""
    await run.drive_on(driver, 0.2, stamped)
    sent_s = run.world.now_s - driver.delay_s - OWN_S
    await asyncio.sleep(FAILSAFE_S - 0.1)
    run.keep("sent", board.speed > 0, "the wheels stop before the time of the command is over")
    await asyncio.sleep(0.1 + driver.delay_s + OWN_S)
    run.keep("stands-in-time", board.speed == 0, f"the wheels turn {run.world.now_s - sent_s:.3f} s after a command")
    driver.send(move(run.setpoint()), stamped=stamped)
    await driver.arrive()
    run.keep("armed", board.speed == 0, "a car that stopped by itself needs no speed 0")
    await driver.settle()
    shown = tuple(driver.told[key] for key in ("state", "angle_deg", "direction", "speed"))
    run.keep("armed", shown == ("failsafe", *NEUTRAL), f"a car that stopped by itself is shown as {shown}")
    run.keep("armed", driver.you["needs-neutral"] == 1, driver.you)
    run.keep("shows-what-is", driver.told["failsafes"] == 1, f"{driver.told['failsafes']} failsafes are counted")
    driver.send(move(NEUTRAL), stamped=stamped)
    await driver.arrive(0.03)
    setpoint = await run.drive_on(driver, 0.15, stamped)
    run.keep("drives-again", board.setpoint == setpoint, "speed 0 doesn't arm the car")


async def pass_the_wheel(run: Track) -> None:
    """Another one gets the wheel when the driver gives it, stands or is silent for long, and not before."""
    async with run.car() as board:
        first, other = await run.client().come(), await run.client().come()
        await run.drive_on(first, 0.2)
        answer = await other.ask("request")
        run.keep("one-driver", not answer["has_wheel"], "who asks gets the wheel of a car that moves")
        ours = await run.drive_on(first, 0.3)
        other.send(move(run.setpoint()))
        await other.arrive()
        run.keep("one-driver", board.setpoint == ours, "two drive")
        await run.drive_on(first, 2 * other.delay_s + 0.2)
        shown = other.you["waits"], other.you["watching"] > 0, other.told["driver"], other.told["wanted_by"]
        run.keep("one-driver", shown == (True, True, first.name, other.name), f"who waits is told {shown}")
        shown = first.you["waits"], first.you["drives"], other.you["drives"]
        run.keep("shows-what-is", shown == (False, True, False), f"who drives is told {shown}")
        first.send(move(NEUTRAL))
        await first.arrive()
        theirs = await run.drive_on(other, 0.2)
        first.send(move(run.setpoint()))
        await first.arrive()
        run.keep("one-driver", board.setpoint == theirs, "the one who asked has no wheel when the driver stands")
        if run.random.random() < 0.5:
            run.keep("one-driver", (await other.ask("release"))["ok"], "the wheel isn't taken back")
            run.keep("one-driver", board.speed == 0, "the wheels turn without a driver")
        else:
            await asyncio.sleep(HAND_OVER_S - 0.5)
            first.send(move(run.setpoint()))
            await first.arrive()
            run.keep("one-driver", board.speed == 0, "who is silent loses the wheel too early")
            await asyncio.sleep(0.5)
        first.send(move(NEUTRAL))
        await first.arrive(0.03)
        last = await run.drive_on(first, 0.1)
        run.keep("one-driver", board.setpoint == last, "nobody can take a wheel that is free")
        await first.settle()
        turns = [who for did, who in run.records if did == "drives"]
        run.keep("logged", turns == [first.name, other.name, first.name], f"{turns}")


async def rate(run: Track) -> None:
    """More than ten commands in a tenth of a second are refused, whatever they switch; speed 0 never is."""
    async with run.car() as board:
        driver = await run.client().come()
        for number in range(60):
            kind = run.random.random()
            if kind < 0.5:
                driver.send(move(run.setpoint()))
            elif kind < 0.9:
                driver.send(SWITCH | HORN if number % 2 else SWITCH | HEAD_LIGHT | HORN)
            else:
                driver.send(move(NEUTRAL))
                await driver.arrive()
                run.keep("over-rate", board.speed == 0, "speed 0 is refused")
            await asyncio.sleep(0.004)
        await driver.settle()
        moves_s = [at_s for setpoint, at_s in board.applied if setpoint[2]]
        lights_s = [at_s for name, _, at_s in board.switched if name == "head_light"]
        _check_rate(run, moves_s)
        _check_rate(run, [*moves_s, *lights_s])
        run.keep("over-rate", driver.you["over-rate"] > 0, f"nothing is refused: {driver.you}")
        driver.send(move(NEUTRAL))
        await driver.arrive(2 * _WINDOW_S)
        last = await run.drive_on(driver, 0.3)
        run.keep("over-rate", board.setpoint == last, "who sends slowly again is refused")


def _check_rate(run: Track, times_s: list[float]) -> None:
    for at_s in times_s:
        # The car's clock has whole milliseconds.
        count = sum(at_s <= other < at_s + _WINDOW_S - 0.002 for other in times_s)
        run.keep("over-rate", count <= _RATE, f"{count} commands in {_WINDOW_S} s")


async def late_commands(run: Track) -> None:
    """Stamped commands that come late move nothing: in the flow, behind an answer, and after a silence."""
    async with run.car() as board:
        driver = await run.client().come(stamped=True)
        begin_s = run.world.now_s
        await run.drive_on(driver, 0.3, stamped=True)
        if run.random.random() < 0.3:
            await _drive_for_long(run, driver, begin_s)
        for age_s in (STALE_S + 0.05, 0.6, 2.0, 6.0):
            await _try_late(run, driver, age_s)
        driver.send(move(run.setpoint()))
        await _still_stands(run, driver, "a command without a stamp, of a client that has stamped")
        driver.send(move(NEUTRAL), stamped=True)
        await driver.arrive(0.03)
        last = await run.drive_on(driver, 0.1, stamped=True)
        run.keep("no-old-command", board.setpoint == last, "fresh commands aren't believed")
        await _after_silence(run, board, driver)


async def _drive_for_long(run: Track, driver: TrackClient, begin_s: float) -> None:
    """What a car knows of a connection it knows on when half a minute is over."""
    while run.world.now_s < begin_s + _HALF_MINUTE_S - 1.0:
        driver.send(move(NEUTRAL), stamped=True)
        await asyncio.sleep(0.5)
    while run.world.now_s < begin_s + _HALF_MINUTE_S + 1.0:
        driver.send(move(NEUTRAL), stamped=True)
        await driver.arrive(0.2)
        driver.send(move(run.setpoint()), stamped=True, age_s=STALE_S + 0.1)
        await _still_stands(run, driver, "an old command in a new half minute")


async def _try_late(run: Track, driver: TrackClient, age_s: float) -> None:
    driver.send(move(NEUTRAL), stamped=True)
    await driver.arrive(0.03)
    driver.send(move(run.setpoint()), stamped=True, age_s=age_s)
    await _still_stands(run, driver, f"a command that is {age_s} s old")


async def _still_stands(run: Track, driver: TrackClient, what: str) -> None:
    await driver.arrive()
    run.keep("no-old-command", run.board.speed == 0, f"{what} moves the car")


async def _after_silence(run: Track, board: TrackBoard, driver: TrackClient) -> None:
    """After a silence the car asks: late answers don't count, nor do commands of before, late ones, or with a speed."""
    driver.send(move(NEUTRAL), stamped=True)
    await asyncio.sleep(_SILENCE_S + 0.2)
    # It looks new: a stamp comes round.
    driver.send(move(run.setpoint()), stamped=True, age_s=_ROUND_S)
    await _still_stands(run, driver, "a command after a silence")
    await driver.settle()
    old = driver.you["clock"]
    run.keep("no-old-command", old is not None, "the car asks for no clock after a silence")
    await asyncio.sleep(_ANSWER_S + 0.1)
    driver.post("sync", clock=old, words=driver.sent, stamp=driver.stamp())
    await driver.arrive()
    driver.send(move(NEUTRAL), stamped=True)
    await driver.arrive(0.03)
    driver.send(move(run.setpoint()), stamped=True)
    await _still_stands(run, driver, "a command behind an answer that came late")
    await driver.answer_clock()
    driver.send(move(NEUTRAL), stamped=True, age_s=STALE_S + 0.1)
    await driver.arrive(0.03)
    driver.send(move(run.setpoint()), stamped=True)
    await _still_stands(run, driver, "a command behind one that came late after the answer")
    # Its answer overtakes the command that was sent before it.
    await driver.answer_clock(under_way=1)
    driver.send(move(NEUTRAL), stamped=True)
    await driver.arrive(0.03)
    driver.send(move(run.setpoint()), stamped=True)
    await _still_stands(run, driver, "a command behind one that was sent before the answer")
    await driver.answer_clock()
    driver.send(move(run.setpoint()), stamped=True)
    await _still_stands(run, driver, "a speed behind a silence")
    await driver.answer_clock()
    driver.send(move(NEUTRAL), stamped=True)
    await driver.arrive(0.03)
    last = await run.drive_on(driver, 0.1, stamped=True)
    run.keep("drives-again", board.setpoint == last, "who has answered the clock isn't believed")


async def believe(run: Track) -> None:
    """A car believes a client by its first words; what is no command ends the connection, and nothing is obeyed."""
    async with run.car() as board:
        setpoint = run.setpoint()
        alone = await run.client().call(COMMANDS)
        alone.send(move(setpoint))
        await alone.arrive()
        run.keep("believed", board.speed == 0, "one word of a stranger moves the car at once")
        await asyncio.sleep(_BELIEVED_S)
        run.keep("believed", board.setpoint == setpoint, "a first command that nothing follows does nothing")
        alone.close()
        await asyncio.sleep(0.1)
        gone = await run.client().call(COMMANDS)
        gone.send(move(setpoint))
        await gone.arrive()
        gone.close()
        await asyncio.sleep(2 * _BELIEVED_S)
        run.keep("believed", board.speed == 0, "one word of a stranger who has left moves the car")
        for words in ((1 << 29, 0), (MOVE | 181 << 20 | 9 << 11,), (3 << 28,), (SWITCH | 1 << 20,)):
            await _send_rubbish(run, (move(setpoint), *words) if run.random.random() < 0.5 else words)
        stamped = await run.client().call(COMMANDS)
        stamped.send(move(setpoint), stamped=True)
        await stamped.arrive(_BELIEVED_S + stamped.delay_s)
        run.keep("believed", stamped.has_ended and board.speed == 0, "who begins with a stamped speed is believed")
        driver = await run.client().come()
        await run.drive_on(driver, 0.2)
        # Cut in any way.
        for byte in move(setpoint).to_bytes(4):
            driver.send_bytes(bytes([byte]))
            await asyncio.sleep(0.003)
        await driver.arrive()
        run.keep("believed", board.setpoint == setpoint, "a command that comes in pieces isn't obeyed")
        before = len(board.applied)
        driver.send(move(run.setpoint()), 1 << 31)
        await driver.arrive(2 * driver.delay_s)
        run.keep("believed", driver.has_ended and board.speed == 0, "who sends what is no command stays connected")
        await driver.settle()
        refused = driver.told["refused"]
        run.keep("shows-what-is", refused >= 4, f"{refused} words that were no commands are counted")
        run.keep("believed", len(board.applied) == before, "what came with what is no command is obeyed")


async def _send_rubbish(run: Track, words: tuple[int, ...]) -> None:
    stranger = await run.client().call(COMMANDS)
    stranger.send(*words)
    await stranger.arrive(_BELIEVED_S + stranger.delay_s)
    shown = [hex(word) for word in words]
    run.keep("believed", run.board.speed == 0, f"{shown} moves the car")
    run.keep("believed", stranger.has_ended, f"who sends {shown} stays connected")
    said = sum(stranger.address in sentence for sentence in run.said)
    run.keep("believed", said == 1, f"the console says {said} times who sent {shown}: {run.said}")


async def stop(run: Track) -> None:
    """Everybody who can connect stops the car, whatever else they ask; it stands until somebody lifts that."""
    async with run.car() as board:
        driver, other = await run.client().come(), await run.client().call(TELEMETRY)
        if run.random.random() < 0.5:
            # A channel that waits for a connection that isn't there.
            other.post("join", port=9)
        for _ in range(run.random.choice((0, 30))):
            other.post("release")
        driving = asyncio.create_task(run.drive_on(driver, 1.0))
        await asyncio.sleep(0.3)
        other.post("stop")
        await other.arrive()
        run.keep("stop-gets-through", board.speed == 0, "the wheels turn after a stop")
        await driving
        run.keep("stop-holds", board.speed == 0, "the driver drives on after a stop")
        await other.settle()
        answer = next((answer for answer in other.answers if answer["do"] == "stop"), {})
        run.keep("stop-gets-through", bool(answer.get("ok")), f"{other.answers[-3:]}")
        await driver.settle()
        run.keep("stop-holds", driver.told["state"] == "stopped" and driver.you["stopped"] > 0, driver.told)
        stops = [who for did, who in run.records if did == "stops"]
        run.keep("logged", [who.rpartition(":")[0] for who in stops] == [other.address], f"{run.records}")
        await asyncio.sleep(1.1)
        await _clear(run, run.random.choice((driver, other)))
        driver.send(move(run.setpoint()))
        await driver.arrive()
        run.keep("armed", board.speed == 0, "a lifted stop needs no speed 0")
        driver.send(move(NEUTRAL))
        await driver.arrive(0.03)
        last = await run.drive_on(driver, 0.1)
        run.keep("drives-again", board.setpoint == last, "nobody can drive when a stop is lifted")


async def _clear(run: Track, who: TrackClient) -> None:
    answer = await who.ask("clear")
    run.keep("drives-again", answer["ok"], answer)
    clears = [name.rpartition(":")[0] for did, name in run.records if did == "clears"]
    run.keep("logged", clears == [who.address], f"{run.records}")


async def arm(run: Track) -> None:
    """Where it is asked, nobody's first command moves the car: each new driver arms it by speed 0."""
    async with run.car(arming=True) as board:
        first, other = run.client(), run.client()
        for client in (first, other):
            await client.call(TELEMETRY)
            await client.call(COMMANDS)
            client.post("join", port=client.port)
            await client.arrive()
            client.send(move(run.setpoint()), move(run.setpoint()))
            await client.settle()
            shown = board.speed, client.told["state"], client.you["needs-neutral"]
            run.keep("armed", shown == (0, "disarmed", 1), f"a first command with a speed: {shown}")
            client.send(move(NEUTRAL))
            await client.arrive(0.03)
            last = await run.drive_on(client, 0.1)
            run.keep("armed", board.setpoint == last, "speed 0 doesn't arm the car")
            client.post("release")
            await client.settle()


async def switch(run: Track) -> None:
    """Only the driver switches; a horn ends by itself, with a stop and with its driver; a light stays till then."""
    has = run.random.choice((("head_light", "horn"), ("head_light", "horn"), ("head_light",), ()))
    async with run.car(switches=has) as board:
        driver, other = await run.client().come(), await run.client().come()
        driver.send(move(NEUTRAL))
        other.send(SWITCH | HEAD_LIGHT | HORN)
        await other.arrive()
        run.keep("switches", not any(board.is_on.values()), "one who doesn't drive switches something on")
        driver.send(SWITCH | HEAD_LIGHT | HORN)
        await driver.arrive()
        on = dict.fromkeys(has, True)
        run.keep("switches", board.is_on == on, f"{board.is_on} in place of {on}")
        # The stick is held on, and the horn isn't.
        driving = asyncio.create_task(run.drive_on(driver, 0.5))
        await driver.settle()
        run.keep("shows-what-is", driver.told["switches"] == dict.fromkeys(has, 1), driver.told["switches"])
        run.keep("switches", bool(driver.you["no-hardware"]) == (not has), f"{has}: {driver.you}")
        await driving
        run.keep("horn-ends", not board.is_on.get("horn"), "a horn sounds on that nobody holds")
        driver.send(SWITCH | HEAD_LIGHT | HORN)
        await driver.arrive()
        other.post("stop")
        await other.arrive()
        run.keep("horn-ends", not board.is_on.get("horn"), "a horn sounds after a stop")
        run.keep("switches", board.is_on.get("head_light", True), "a stop switches the light off")
        await _pass_the_horn(run, driver, other)
        visitor = await run.client().call(COMMANDS)
        visitor.send(move(NEUTRAL), move(NEUTRAL))
        await visitor.arrive()
        visitor.close()
        await visitor.arrive()
        run.keep("switches", board.is_on.get("head_light", True), "who leaves switches off what another switched on")
        driver.close()
        await driver.arrive()
        run.keep("switches", not any(board.is_on.values()), "what a driver who has left switched on stays on")
        counts = Counter(name for name, _, _ in board.switched)
        run.keep("switches", all(count <= 6 for count in counts.values()), f"{counts}")


async def _pass_the_horn(run: Track, driver: TrackClient, other: TrackClient) -> None:
    """A horn is silent at once when the wheel passes to another; a light stays."""
    await driver.ask("clear")
    driver.send(move(NEUTRAL))
    await driver.arrive(0.03)
    await other.ask("request")
    await driver.ask("request")
    driver.send(move(NEUTRAL))
    driver.send(SWITCH | HEAD_LIGHT | HORN)
    await driver.arrive()
    await other.ask("request")
    driver.send(move(NEUTRAL))
    await driver.arrive()
    run.keep("horn-ends", not run.board.is_on.get("horn"), "a horn sounds on when the wheel passes to another")
    run.keep("switches", run.board.is_on.get("head_light", True), "a light goes off when the wheel passes to another")


ACTS = (drive, pass_the_wheel, rate, late_commands, believe, stop, arm, switch)
