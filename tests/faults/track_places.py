"""Who has a place at the car of a quiet room, and what a channel for telemetry may ask."""

import asyncio
import json
import struct

from tests.faults.track_car import COMMANDS, HAND_OVER_S, NEUTRAL, OWN_S, TELEMETRY, Track, TrackClient, move

_PLACES, _WATCHERS, _MOST_REQUESTS, _MOST_OF_ONE = 9, 4, 20, 16
_JOIN_S = 1.2
_MOST_WAITING_BYTES = 1 << 15


async def places(run: Track) -> None:
    """Nine have places; the tenth gets one of who has many, or of who is silent; the driver keeps the wheel."""
    async with run.car() as board:
        crowd_of_one = run.random.random() < 0.5
        address = "10.0.200.1" if crowd_of_one else ""
        driver = await run.client(address).come()
        others = [await run.client(address).call(COMMANDS) for _ in range(_PLACES - 1)]

        async def hold() -> None:
            while True:
                driver.send(move(run.setpoint()))
                for other in others:
                    if not other.has_ended:
                        other.send(move(NEUTRAL))
                await asyncio.sleep(0.1)

        holding = asyncio.create_task(hold())
        await asyncio.sleep(0.3)
        run.keep("places", not any(other.has_ended for other in others), "nine clients have no places")
        run.keep("places", driver.told["watchers"] == _PLACES - 1, f"{driver.told['watchers']} watch")
        tenth = await run.client().call(COMMANDS)
        tenth.send(move(NEUTRAL), move(NEUTRAL))
        await asyncio.sleep(0.3)
        ended = sum(other.has_ended for other in others)
        shown = tenth.has_ended, ended, driver.has_ended
        wanted = (False, 1, False) if crowd_of_one else (True, 0, False)
        run.keep("places", shown == wanted, f"of ten clients these have ended: {shown}")
        run.keep("one-driver", driver.you["drives"] and board.speed > 0, "the driver loses the wheel to a newcomer")
        run.keep("places", driver.told["turned_away"] == 1, f"{driver.told['turned_away']} were turned away")
        holding.cancel()
        await _replace_the_silent(run, driver, [*others, tenth])


async def _replace_the_silent(run: Track, driver: TrackClient, others: list[TrackClient]) -> None:
    """Who sends no command for long gives the place to a newcomer who does."""
    silent = next(other for other in others if not other.has_ended)
    # Words that are old are none: whoever has stamped one has to stamp all.
    sends_old = run.random.random() < 0.5
    if sends_old:
        silent.send(move(NEUTRAL), stamped=True)
    end_s = run.world.now_s + HAND_OVER_S + 0.3
    while run.world.now_s < end_s:
        driver.send(move(NEUTRAL))
        for other in others:
            if (sends_old or other is not silent) and not other.has_ended:
                other.send(move(NEUTRAL))
        await asyncio.sleep(0.2)
    newcomer = await run.client().call(COMMANDS)
    newcomer.send(move(NEUTRAL), move(NEUTRAL))
    await asyncio.sleep(0.3)
    shown = newcomer.has_ended, silent.has_ended, driver.has_ended
    run.keep("places", shown == (False, True, False), f"a newcomer, who is silent and the driver have ended: {shown}")


async def connections(run: Track) -> None:
    """An address keeps sixteen connections, the newest; others, and who drives, notice nothing."""
    async with run.car():
        driver, watcher = await run.client().come(), await run.client().call(TELEMETRY)
        many = [await run.client("10.0.201.1").call(COMMANDS) for _ in range(_MOST_OF_ONE + 5)]
        await run.drive_on(driver, 0.3)
        ended = [client.has_ended for client in many]
        run.keep("connections-bounded", ended == [True] * 5 + [False] * _MOST_OF_ONE, f"{ended}")
        shown = driver.has_ended, watcher.is_hung_up
        run.keep("connections-bounded", shown == (False, False), f"a driver and a watcher have ended: {shown}")


async def watch(run: Track) -> None:
    """One client has four places to watch; who has none is told why. While nobody drives one is left for a driver."""
    async with run.car():
        channels = [await run.client("10.0.202.1").call(TELEMETRY) for _ in range(_WATCHERS + 1)]
        await asyncio.sleep(_JOIN_S)
        told = [answer.get("code") for channel in channels for answer in channel.answers]
        run.keep("places", told == ["enough-of-you"], f"five channels of one client are told {told}")
    async with run.car() as board:
        channels = [await run.client().call(TELEMETRY) for _ in range(_PLACES)]
        await asyncio.sleep(_JOIN_S)
        told = [answer.get("code") for channel in channels for answer in channel.answers]
        run.keep("places", told == ["full"], f"nine watchers without a driver are told {told}")
        driver = await run.client().come()
        last = await run.drive_on(driver, 0.2)
        run.keep("places", board.setpoint == last, "watchers keep a driver out")
        driver.close()
        await channels[0].settle()
        await asyncio.sleep(0.1)
        shown = [channels[0].told[key] for key in ("driver", "age_ms", "wanted_by")]
        run.keep("shows-what-is", shown == [None] * 3, f"of a car that nobody drives is told {shown}")
    async with run.car():
        driver = await run.client().come()
        driving = asyncio.create_task(run.drive_on(driver, _JOIN_S + 0.4))
        await asyncio.sleep(0.1)
        channels = [await run.client().call(TELEMETRY) for _ in range(_PLACES - 1)]
        await driving
        told = [answer.get("code") for channel in channels for answer in channel.answers]
        run.keep("places", not told, f"eight watchers beside a driver are told {told}")


async def join(run: Track) -> None:
    """A channel belongs to its own client's connection: nobody names another's, and asks in its name."""
    async with run.car() as board:
        driver, thief = await run.client().come(), await run.client().call(TELEMETRY)
        thief.post("join", port=driver.port)
        for do in ("release", "resume", "sync"):
            thief.post(do)
        last = await run.drive_on(driver, 1.3)
        run.keep("own-session", board.setpoint == last, "one client gives the wheel of another back")
        await thief.settle()
        codes = [answer.get("code") for answer in thief.answers if answer["do"] == "join"]
        run.keep("own-session", codes == ["no-such-connection"], f"who names another's port is told {thief.answers}")
        run.keep("own-session", thief.you.get("name") != driver.name, f"who names another's port is {thief.you}")
        run.keep("own-session", driver.you["drives"], "a channel loses its connection to another client's")
        asked = [answer["do"] for answer in thief.answers]
        run.keep("as-asked", asked == ["join", "release", "resume", "sync"], f"answers come to {asked}")
        thief.close()
        # Who watched before has one place, not two.
        late = await run.client().call(TELEMETRY)
        await asyncio.sleep(_JOIN_S)
        run.keep("places", late.told["watchers"] == 1, f"{late.told['watchers']} watch beside the driver")
        await late.call(COMMANDS)
        late.post("join", port=late.port)
        late.send(move(NEUTRAL), move(NEUTRAL))
        await late.settle()
        run.keep("places", late.told["watchers"] <= 1, f"{late.told['watchers']} watch, though two are connected")
        late.close()
        # Behind a proxy nobody knows the port; the only connection that has no channel is meant.
        plain = run.client()
        await plain.call(COMMANDS)
        await plain.call(TELEMETRY)
        plain.send(move(NEUTRAL), move(NEUTRAL))
        plain.post("join", port=1)
        await asyncio.sleep(_JOIN_S + 0.2)
        run.keep("own-session", plain.you.get("name") == plain.name, f"{plain.name} is called {plain.you}")
        # Until another one at its address names the connection.
        named = run.client(plain.address)
        await named.call(TELEMETRY)
        named.post("join", port=plain.port)
        await named.settle()
        shown = named.you.get("name"), plain.you.get("name") == plain.name
        run.keep("own-session", shown == (plain.name, False), f"of two channels one names {plain.name}: {shown}")


async def ask(run: Track) -> None:
    """Each request is answered, in order; too many, and what is none, are refused, and nothing else changes."""
    async with run.car(has_program=run.random.random() < 0.5) as board:
        driver = await run.client().come()
        kinds = [run.random.choice(("request", "release", "clear")) for _ in range(_MOST_REQUESTS + 10)]
        await asyncio.sleep(1.1)
        for do in kinds:
            driver.post(do)
        await driver.settle()
        answers = [answer for answer in driver.answers if answer["do"] != "join"]
        run.keep("as-asked", [answer["do"] for answer in answers] == kinds, f"{[each['do'] for each in answers]}")
        refused = [answer.get("code") for answer in answers if not answer["ok"]]
        run.keep("as-asked", refused == ["too-many-requests"] * 10, f"{refused}")
        await asyncio.sleep(1.1)
        for data in (b"{}", b"[1]", b'{"do": "fly"}', b"\xff", b'{"do": "join", "port": "x"}'):
            driver.answers.clear()
            driver.send_bytes(struct.pack(">I", len(data)) + data, TELEMETRY)
            await driver.settle()
            (answer,) = driver.answers
            shown = answer["do"], answer["code"], bool(answer["en"] and answer["zh"])
            run.keep("says-why", shown == (None, "not-a-request", True), f"{data!r} gets {answer}")
        await _resume(run, driver, board.has_program)
        driver.answers.clear()
        driver.send_bytes(struct.pack(">I", 1025) + b"x", TELEMETRY)
        await driver.settle()
        codes = [answer.get("code") for answer in driver.answers]
        run.keep("says-why", codes == ["too-long"] and driver.is_hung_up, f"a request that is too long gets {codes}")


async def _resume(run: Track, driver: TrackClient, has_program: bool) -> None:
    """A car's own program drives again where it has one, nobody else drives, and no stop holds."""
    driver.send(move(NEUTRAL))
    await driver.arrive()
    if not has_program:
        answer = await driver.ask("resume")
        run.keep("as-asked", answer.get("code") == "no-program", f"{answer}")
        return
    other = await run.client().come()
    driver.send(move(NEUTRAL))
    await driver.arrive()
    answer = await other.ask("resume")
    run.keep("one-driver", answer.get("code") == "not-yours", f"who doesn't drive lets the program drive: {answer}")
    other.post("stop")
    await other.arrive()
    answer = await driver.ask("resume")
    run.keep("stop-holds", not answer["ok"] and not run.board.runs, f"the program drives after a stop: {answer}")
    await driver.ask("clear")
    answer = await driver.ask("resume")
    await driver.settle()
    shown = answer["ok"], run.board.runs, driver.told["state"]
    run.keep("as-asked", shown == (True, True, "program"), f"{shown}")
    run.keep("logged", ("resumes", driver.name) in run.records, f"{run.records}")
    driver.send(move(NEUTRAL))
    await driver.arrive()
    run.keep("as-asked", run.board.runs, "speed 0 takes the wheels from the program")
    last = await run.drive_on(driver, 0.1)
    run.keep("as-asked", (run.board.runs, run.board.setpoint) == (False, last), "nobody can drive a car with a program")
    await driver.ask("resume")
    run.board.is_broken = True
    await asyncio.sleep(0.2)
    run.keep("stands-in-time", (run.board.runs, run.board.speed) == (False, 0), "a program that hangs drives on")


async def read_nothing(run: Track) -> None:
    """Who asks and reads nothing costs little, gets old telemetry never, and others notice nothing."""
    async with run.car():
        driver = await run.client().come()
        lazy = await run.client("10.0.203.1").call(TELEMETRY)
        transport = lazy._writers[TELEMETRY].transport
        transport.pause_reading()  # type: ignore[attr-defined]
        slow = await run.client().call(TELEMETRY)
        await slow.settle()
        slow._writers[TELEMETRY].transport.pause_reading()  # type: ignore[attr-defined]
        text = json.dumps({"do": "release"}).encode()
        for _ in range(400):
            with_size = struct.pack(">I", len(text)) + text
            if not transport.is_closing():
                transport.write(with_size * 10)
            await asyncio.sleep(0.01)
            assert run.loop
            sizes = [line.get_write_buffer_size() for line in run.loop.transports()]
            run.keep("memory-bounded", max(sizes, default=0) <= _MOST_WAITING_BYTES, f"{sizes}")
        begin_s = run.world.now_s
        last = await run.drive_on(driver, 0.3)
        run.keep("one-driver", run.board.setpoint == last, "who reads nothing keeps the driver from driving")
        await asyncio.sleep(6.0)
        slow._writers[TELEMETRY].transport.resume_reading()  # type: ignore[attr-defined]
        await asyncio.sleep(1.0)
        run.keep("shows-what-is", not slow.is_hung_up, "who reads nothing for a while is hung up")
        run.keep("shows-what-is", slow.told["driver"] == driver.told["driver"], "who reads again gets old telemetry")
        is_told = [at_s for at_s in driver.told_s if at_s > begin_s + OWN_S]
        run.keep("shows-what-is", len(is_told) >= 2, "who reads nothing keeps telemetry from others")


ACTS = (places, connections, watch, join, ask, read_nothing)
