"""A room of 1,000 simulated cars: find, load and stop them all, beside a bare client that only sends the bytes.

The cars run in processes of their own at ports of loopback. For the stop 100 of them are dead (their process is
killed) and 100 are frozen (theirs is stopped by a signal; POSIX alone). Prints JSON: seconds, and ratios of the same
run.
"""

import argparse
import asyncio
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from binascii import crc32
from pathlib import Path
from statistics import median

from motorcade.fleet.cars import Cars
from motorcade.fleet.places import Place, read_list
from motorcade.sockets import allow_files
from motorcade.words.image import Image, image_words
from motorcade.words.packing import words_to_bytes
from motorcade.words.request import STOP

AT_ONCE = 64
WORDS = 100
STOPPED_S = 0.3
_LOOK_S = 0.002


def image_of(seed: int) -> bytes:
    """An image of WORDS words."""
    states = [0x64800000 | (seed + place) % 4 << 21 for place in range(WORDS - 1)]
    return words_to_bytes(image_words(Image(states, [], 0, 0)))


def start(count: int, first_number: int, folder: Path) -> tuple[subprocess.Popen[bytes], list[Place]]:
    """Start cars in a process; return it when they can be reached, and where they are."""
    listed = folder / f"cars-{first_number}.toml"
    command = [
        "car",
        "run",
        "--board",
        "simulated",
        "--count",
        count,
        "--number",
        first_number,
        "--list",
        listed,
        "--json",
    ]
    process = subprocess.Popen([sys.executable, "-m", "motorcade", *map(str, command)], stdout=subprocess.PIPE)
    assert process.stdout
    process.stdout.readline()
    return process, read_list(listed)


async def bare(places: list[Place], image: bytes, reads: bool) -> float:
    """Send an image to all places as section 7's plain protocol does; return the seconds. ``reads`` waits for OK."""
    free = asyncio.Semaphore(AT_ONCE)
    answer = f"crc32={crc32(image):08x}".encode()

    async def send(place: Place) -> None:
        async with free:
            reader, writer = await asyncio.open_connection(place.host, place.port)
            writer.write(image)
            await writer.drain()
            if reads:
                assert answer in await reader.readline()
            writer.close()
            await writer.wait_closed()

    begin_s = time.perf_counter()
    await asyncio.gather(*map(send, places))
    return time.perf_counter() - begin_s


async def load_all(places: list[Place], times: int) -> dict[str, float]:
    """Find and load all cars, several times in turn with the bare clients; return medians in seconds."""
    found, loaded, sent, answered = [], [], [], []
    for turn in range(times):
        begin_s = time.perf_counter()
        async with Cars(places) as cars:
            await cars.known(60)
            found.append(time.perf_counter() - begin_s)
            assert not any(each.away for each in cars.statuses())
            begin_s = time.perf_counter()
            verdicts = await cars.load(image_of(turn), ["all"])
            loaded.append(time.perf_counter() - begin_s)
            assert not [each for each in verdicts if each.error]
        answered.append(await bare(places, image_of(turn + 1), True))
        sent.append(await bare(places, image_of(turn + 2), False))
        # What was only sent is still being taken.
        await asyncio.sleep(1)
    return {
        "find_s": median(found),
        "load_s": median(loaded),
        "bare_sends_s": median(sent),
        "bare_sends_and_reads_s": median(answered),
    }


async def stop_all(
    places: list[Place], frozen: subprocess.Popen[bytes], dead: subprocess.Popen[bytes]
) -> dict[str, object]:
    """Stop all, while some are dead and some are frozen; return when those that live have stopped."""
    async with Cars(places) as cars:
        await cars.known(60)
        dead.kill()
        dead.wait()
        os.kill(frozen.pid, signal.SIGSTOP)
        try:
            # Until the dead and the frozen are known to be away, as after some seconds of a lesson.
            while sum(each.away for each in cars.statuses()) < 200:
                await asyncio.sleep(0.1)
            living = len(places) - 200
            contacts = cars.named(["all"])
            begin_s = time.perf_counter()
            cars.order(STOP)
            confirmed: list[tuple[float, int]] = []
            while not confirmed or (confirmed[-1][1] < living and confirmed[-1][0] < 10):
                await asyncio.sleep(_LOOK_S)
                confirmed.append((time.perf_counter() - begin_s, sum(not each.wanted for each in contacts)))
            begin_s = time.perf_counter()
            verdicts = await cars.load(image_of(9), ["all"])
            load_s = time.perf_counter() - begin_s
        finally:
            os.kill(frozen.pid, signal.SIGCONT)
        begin_s = time.perf_counter()
        late = await cars.confirmed(1.0)
        while len(late) > 100 and time.perf_counter() - begin_s < 20:
            late = await cars.confirmed(0.5)
    within = max(count for at_s, count in confirmed if at_s <= STOPPED_S) if confirmed[0][0] <= STOPPED_S else 0
    return {
        "stopped_within_0.3_s": within / living,
        "all_living_stopped_s": confirmed[-1][0],
        "frozen_stopped_when_back_s": time.perf_counter() - begin_s,
        "load_with_200_away_s": load_s,
        "verdicts": {holds: sum(each.holds == holds for each in verdicts) for holds in ("new", "old", "away")},
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cars", type=int, default=1000)
    parser.add_argument("--times", type=int, default=3)
    arguments = parser.parse_args()
    allow_files(4 * arguments.cars + 64)
    processes = []
    with tempfile.TemporaryDirectory() as folder:
        try:
            made = [
                start(count, first, Path(folder))
                for count, first in ((arguments.cars - 200, 0), (100, 8000), (100, 9000))
            ]
            processes = [process for process, _ in made]
            places = [place for _, listed in made for place in listed]
            figures: dict[str, object] = {
                "cars": len(places),
                "processors": os.cpu_count(),
                "load_average": os.getloadavg()[0],
            }
            seconds = asyncio.run(load_all(places, arguments.times))
            figures |= seconds
            figures["speed_to_bare_that_sends"] = seconds["bare_sends_s"] / seconds["load_s"]
            figures["speed_to_bare_that_reads"] = seconds["bare_sends_and_reads_s"] / seconds["load_s"]
            figures |= asyncio.run(stop_all(places, processes[1], processes[2]))
            print(json.dumps(figures, indent=1))
        finally:
            for process in processes:
                process.kill()
                process.wait()


if __name__ == "__main__":
    main()
