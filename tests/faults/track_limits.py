"""What stops the wheels of a car in a quiet room beside its driver: hardware, software, an obstacle, the battery."""

import asyncio

from tests.faults.track_car import FAILSAFE_S, HORN, NEUTRAL, SWITCH, WATCHDOG_S, Track, TrackClient, move

_LIMITS_S, _BEAT_S, _READINGS_S = 0.04, 0.07, 3.3
_NEAR_MM, _LOW_MV, _CHARGED_MV = 300, 6600, 7400


async def fail(run: Track) -> None:
    """Hardware that fails stops the wheels, as soon as it does anything again; then a command with speed 0 arms it."""
    async with run.car() as board:
        driver = await run.client().come()
        await run.drive_on(driver, 0.2)
        board.fails = run.random.randint(1, 4)
        driver.send(move(run.setpoint()))
        await driver.arrive()
        while board.fails:
            await asyncio.sleep(0.01)
        await asyncio.sleep(_BEAT_S)
        run.keep("guarded", board.speed == 0, "the wheels turn on when the hardware failed and works again")
        driver.send(move(run.setpoint()))
        await driver.arrive()
        run.keep("armed", board.speed == 0, "after a fault no speed 0 is needed")
        await driver.settle()
        shown = driver.told["faults"] > 0, "no answer" in driver.told["last_fault"], driver.told["state"]
        run.keep("shows-what-is", shown == (True, True, "failsafe"), f"after a fault the telemetry is {shown}")
        await _drive_again(run, driver)
        # The stop itself fails.
        driver.send(move(run.setpoint(200)))
        await driver.arrive()
        board.fails = run.random.randint(1, 4)
        await asyncio.sleep(FAILSAFE_S)
        while board.fails:
            await asyncio.sleep(0.01)
        await asyncio.sleep(_BEAT_S)
        run.keep("stands-in-time", board.speed == 0, "a stop that the hardware refused isn't made again")
        await _drive_again(run, driver)
        driver.send(SWITCH | HORN)
        await driver.arrive()
        board.switch_fails = run.random.randint(1, 3)
        await run.drive_on(driver, FAILSAFE_S + 4 * _BEAT_S)
        run.keep("horn-ends", not board.is_on["horn"], "a horn that the hardware didn't end sounds on")


async def _drive_again(run: Track, driver: TrackClient) -> None:
    driver.send(move(NEUTRAL))
    await driver.arrive(0.03)
    last = await run.drive_on(driver, 0.1)
    run.keep("drives-again", run.board.setpoint == last, "a car can't be driven again")


async def be_stuck(run: Track) -> None:
    """Software that is stuck stops the wheels, and what has come meanwhile is old."""
    async with run.car() as board:
        driver = await run.client().come()
        driving = asyncio.create_task(run.drive_on(driver, 1.4))
        await asyncio.sleep(0.3)
        assert run.loop
        begin_s = run.world.now_s
        run.loop.soon(lambda: run.world.sleep(0.8))
        await asyncio.sleep(WATCHDOG_S - 0.08)
        run.keep("sent", board.speed > 0, "a short delay stops the wheels")
        await asyncio.sleep(0.08 + _BEAT_S)
        run.keep("stands-in-time", board.speed == 0, "the wheels turn though the car's software is stuck")
        while run.world.now_s < begin_s + 1.0:
            await asyncio.sleep(0.02)
            run.keep("no-old-command", board.speed == 0, "what came while the software was stuck moves the car")
        await driving
        run.keep("armed", board.speed == 0, "after a stall no speed 0 is needed")
        await driver.settle()
        run.keep("shows-what-is", driver.told["stalls"] == 1, f"{driver.told['stalls']} stalls are counted")
        await _drive_again(run, driver)
        run.loop.soon(lambda: run.world.sleep(0.4))
        await asyncio.sleep(0.6)
        await driver.settle()
        run.keep("shows-what-is", driver.told["stalls"] == 2, f"{driver.told['stalls']} of two stalls are counted")


async def obstacle(run: Track) -> None:
    """An obstacle ahead stops a car that drives forward; it may drive back, and on when the obstacle has gone."""
    async with run.car(obstacle_stop_mm=_NEAR_MM) as board:
        driver = await run.client().come()
        board.distance_mm = 1000
        holding = asyncio.create_task(_hold(driver, (80, 1, 200)))
        await asyncio.sleep(0.2)
        run.keep("limits", board.setpoint == (80, 1, 200), f"{board.setpoint} though nothing is near")
        for distance_mm, goes in ((_NEAR_MM - 1, False), (_NEAR_MM + 50, False), (_NEAR_MM * 5 // 4 + 1, True)):
            board.distance_mm = distance_mm
            await asyncio.sleep(_LIMITS_S + 0.02)
            run.keep("limits", (board.speed > 0) == goes, f"the car's speed is {board.speed} at {distance_mm} mm")
            await driver.settle()
            told = driver.told["obstacle_mm"]
            run.keep("shows-what-is", told == (None if goes else distance_mm), f"{told} in place of {distance_mm}")
        board.distance_mm = 10
        holding.cancel()
        holding = asyncio.create_task(_hold(driver, (80, 0, 200)))
        await asyncio.sleep(0.2)
        run.keep("limits", board.setpoint == (80, 0, 200), "an obstacle ahead stops a car that drives back")
        holding.cancel()


async def _hold(driver: TrackClient, setpoint: tuple[int, int, int]) -> None:
    while True:
        driver.send(move(setpoint))
        await asyncio.sleep(0.05)


async def battery(run: Track) -> None:
    """A low battery stops the car and keeps it, until it is charged; so does one that can't be read."""
    async with run.car(battery_low_mv=_LOW_MV, battery_charged_mv=_CHARGED_MV) as board:
        board.voltage_mv = 8000
        driver = await run.client().come()
        await run.drive_on(driver, 1.2)
        run.keep("shows-what-is", driver.told["battery_mv"] == 8000, driver.told["battery_mv"])
        board.voltage_mv = _LOW_MV - 1
        board.battery_fails = run.random.random() < 0.5
        await run.drive_on(driver, 1.2)
        run.keep("limits", board.speed > 0, "one low reading stops the car")
        await run.drive_on(driver, _READINGS_S)
        board.battery_fails = False
        await driver.settle()
        shown = board.speed, driver.told["state"], driver.you["discharged"] > 0
        run.keep("limits", shown == (0, "discharged", True), f"with a low battery: {shown}")
        board.voltage_mv = _CHARGED_MV - 1
        driver.send(move(NEUTRAL))
        await run.drive_on(driver, _READINGS_S + 1.0)
        run.keep("limits", board.speed == 0, "a battery that isn't charged lets the car drive")
        board.voltage_mv = _CHARGED_MV
        await asyncio.sleep(_READINGS_S + 1.0)
        driver.send(move(run.setpoint()))
        await driver.arrive()
        run.keep("armed", board.speed == 0, "behind a low battery no speed 0 is needed")
        driver.send(move(NEUTRAL))
        await driver.arrive(0.03)
        await run.drive_on(driver, 0.1)
        run.keep("limits", board.speed > 0, "a charged battery lets nobody drive")


async def speed_up(run: Track) -> None:
    """A car speeds up no faster than its profile says, and nothing slows its stop down."""
    async with run.car(acceleration_max_mm_per_s2=100) as board:
        driver = await run.client().come()
        holding = asyncio.create_task(_hold(driver, (90, 1, 255)))
        await asyncio.sleep(0.4)
        early = board.speed
        await asyncio.sleep(0.4)
        # Full duty is the fastest speed of the profile.
        most = 0.85 * 255 * 100 / run.top_speed_mm_s
        run.keep("limits", 0 < early < board.speed <= most, f"{early} and {board.speed}, of at most {most}")
        holding.cancel()
        driver.send(move((90, 1, early // 2)))
        await driver.arrive()
        run.keep("limits", board.speed == early // 2, "a slower command takes its time")
        driver.send(move(NEUTRAL))
        await driver.arrive()
        run.keep("limits", board.speed == 0, "a command to stop takes its time")


ACTS = (fail, be_stuck, obstacle, battery, speed_up)
