"""A car's loop in the time that it takes on a chip: how long its turns are, and what it hears and answers meanwhile.

For metered MicroPython: ``node run_micropython.mjs timed_car SETTINGS PLATFORM SECONDS SCRIPT``; the script is as
driven_car.py's. Prints the outputs (``at_ms what value``) and then figures, one a line.
"""

import gc

from driven_car import Bench, play
from meter import executed
from simulated.timing import Meter

from motorcade.boards.on_chip.power_on import Loop, load_settings, open_board

TURNS_A_LINE = 50


class Noted:
    """Count the frames that the car hears, by replacing ``note``."""

    def __init__(self, board):
        self.heard = 0
        board.note = self.note

    def note(self, kind, at_ms, word, detail):
        self.heard += kind == "heard"


def lines(settings, platform, seconds, script, counts_bytes=False, flash_is_slow=False):
    bench = Bench(settings, platform)
    chip = bench.chip
    board = open_board(load_settings(bench.flash.open), bench.modules)
    noted = Noted(board)
    loop = Loop(board, bench.modules)
    play(bench, script)
    gc.collect()
    yield "turns"
    chip.meter = meter = Meter(chip, executed, gc.mem_alloc if counts_bytes else None, int(flash_is_slow))
    sleeps = Sleeps(bench.clock, chip)
    longest_us, storing_us, turns = 0, 0, 0
    # In the second half of the time nothing is uploaded.
    longest_at_work_us = 0
    meter.stop()
    while chip.now_us < seconds * 1_000_000:
        turn_us, stored, collected = chip.now_us, len(bench.stored), bench.collector.collections
        meter.start()
        loop.turn()
        meter.stop()
        took_us = chip.now_us - turn_us - sleeps.take()
        if len(bench.stored) > stored:
            # This turn stores an image, which takes long.
            storing_us = took_us
        else:
            longest_us = max(longest_us, took_us)
        if turn_us > seconds * 500_000 and bench.collector.collections == collected:
            longest_at_work_us = max(longest_at_work_us, took_us)
        turns += 1
        bench.observed.look()
        if turns % TURNS_A_LINE == 0:
            for at_ms, what, value in bench.observed.seen:
                yield f"{at_ms} {what} {value!r}"
            bench.observed.seen.clear()
            # This build collects garbage when a call from JavaScript returns, if it was asked to.
            gc.collect()
            yield "turns"
    for at_ms, what, value in bench.observed.seen:
        yield f"{at_ms} {what} {value!r}"
    yield f"longest_us {longest_us}"
    yield f"longest_at_work_us {longest_at_work_us}"
    yield f"storing_us {storing_us}"
    yield f"turned_while_storing {len([1 for _, turns in bench.stored if turns])}"
    if counts_bytes:
        yield f"bytes_a_turn {meter.bytes // turns}"
    yield f"heard {noted.heard}"
    yield f"announced {len(bench.wifi.announced)}"
    yield f"collections {bench.collector.collections}"


class Sleeps:
    """Measure how long the loop sleeps."""

    def __init__(self, clock, chip):
        self._slept_us = 0
        self._chip = chip
        self._sleep_ms = clock.sleep_ms
        clock.sleep_ms = self._sleep

    def take(self):
        slept_us, self._slept_us = self._slept_us, 0
        return slept_us

    def _sleep(self, duration_ms):
        self._chip.meter.stop()
        begin_us = self._chip.now_us
        self._sleep_ms(duration_ms)
        self._slept_us += self._chip.now_us - begin_us
        self._chip.meter.start()
