"""Run conformance.py with the brain that the simulator compiles: ``python run_compiled.py SEED STEPS EVERY``."""

import sys
from pathlib import Path
from typing import Any

import conformance
import numba
import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[2]))
from scripts.engine_code import OPTIONS, register

from motorcade.car import brain, frames, loop, next_wakeup, step
from motorcade.car.senses import Senses

SWITCH_ON, LEADER_START, LEADER_STEP, LEADER_SENDS, LEADER_FRAME, FRAMES_REST = range(6)
FOLLOWER_STEP, FOLLOWER_HEARS, FOLLOWER_SENDS, RELAY_REST = range(6, 10)
HEAR_VOICE, LOOKS, WHEELS, LED, WORD_REST = range(10, 15)
LEADER_BEGIN, FOLLOWER_FRAME = range(15, 17)


def call(which: int, memory: Any, images: Any, first: int, second: int, now: int, levels: Any) -> int:
    """Call one of the brain's functions with arrays as the simulator has them."""
    s, image = memory[:, 0], images[0]
    if which == SWITCH_ON:
        brain.switch_on(s, first, now)
    if which == LEADER_START:
        return brain.leader_start(s, image, now)
    if which == LEADER_STEP:
        return brain.leader_step(s, image, now, levels)
    if which == LEADER_SENDS:
        return frames.leader_sends(s, image, first, now, levels)
    if which == LEADER_FRAME:
        return int(frames.leader_frame(s, image))
    if which == FRAMES_REST:
        return next_wakeup.frames_rest_ms(s, image, first, now, levels)
    if which == FOLLOWER_STEP:
        return brain.follower_step(s, now, levels)
    if which == FOLLOWER_HEARS:
        return frames.follower_hears(s, first, now, levels)
    if which == FOLLOWER_SENDS:
        return frames.follower_sends(s, first, now, levels)
    if which == RELAY_REST:
        return next_wakeup.relay_rest_ms(s, first, now)
    if which == HEAR_VOICE:
        brain.hear_voice(s, first)
    if which == LOOKS:
        return brain.looks_mm(s, now, levels)
    if which == WHEELS:
        return brain.wheels(s, Senses(first, second & 1, second >> 1), now, levels)
    if which == LED:
        return brain.lit_led(s, now, levels)
    if which == WORD_REST:
        return next_wakeup.word_rest_ms(s, now, levels)
    if which == LEADER_BEGIN:
        frames.leader_begin(s, image, now)
    if which == FOLLOWER_FRAME:
        return int(frames.follower_frame(s))
    return 0


class CompiledBrain:
    """A replacement for `motorcade.car.brain`, `motorcade.car.frames` and `motorcade.car.next_wakeup`."""

    def __init__(self) -> None:
        register()
        self._call = numba.njit(**OPTIONS)(call)

    def __getattr__(self, name: str) -> Any:
        return getattr(brain if hasattr(brain, name) else frames, name)

    def _run(self, which: int, s: list[int], image=(0,), now=0, levels=(0,), first=0, second=0) -> int:
        memory = np.array(s, np.uint32).reshape(-1, 1)
        arrays = memory, np.array([image], np.uint32)
        found = self._call(which, *arrays, int(first), int(second), now, np.array(levels, np.int64))
        s[:] = memory[:, 0].tolist()
        return int(found)

    def switch_on(self, s, number, now):
        self._run(SWITCH_ON, s, now=now, first=number)

    def leader_start(self, s, image, now):
        return self._run(LEADER_START, s, image, now)

    def leader_step(self, s, image, now, levels):
        return self._run(LEADER_STEP, s, image, now, levels)

    def leader_begin(self, s, image, now):
        self._run(LEADER_BEGIN, s, image, now)

    def leader_sends(self, s, image, air_is_busy, now, levels):
        return self._run(LEADER_SENDS, s, image, now, levels, first=air_is_busy)

    def leader_frame(self, s, image):
        return self._run(LEADER_FRAME, s, image)

    def follower_frame(self, s):
        return self._run(FOLLOWER_FRAME, s)

    def frames_rest_ms(self, s, image, free_ms, now, levels):
        return self._run(FRAMES_REST, s, image, now, levels, first=free_ms)

    def follower_step(self, s, now, levels):
        return self._run(FOLLOWER_STEP, s, now=now, levels=levels)

    def follower_hears(self, s, frame, now, levels):
        return self._run(FOLLOWER_HEARS, s, now=now, levels=levels, first=frame)

    def follower_sends(self, s, air_is_busy, now, levels):
        return self._run(FOLLOWER_SENDS, s, now=now, levels=levels, first=air_is_busy)

    def relay_rest_ms(self, s, free_ms, now):
        return self._run(RELAY_REST, s, now=now, first=free_ms)

    def hear_voice(self, s, voice):
        self._run(HEAR_VOICE, s, first=voice)

    def looks_mm(self, s, now, levels):
        return self._run(LOOKS, s, now=now, levels=levels)

    def wheels(self, s, senses, now, levels):
        second = senses.person | senses.dark_floor << 1
        return self._run(WHEELS, s, now=now, levels=levels, first=senses.obstacle_mm, second=second)

    def lit_led(self, s, now, levels):
        return self._run(LED, s, now=now, levels=levels)

    def word_rest_ms(self, s, now, levels):
        return self._run(WORD_REST, s, now=now, levels=levels)


if __name__ == "__main__":
    step.brain = step.frames = loop.brain = conformance.brain = conformance.frames = CompiledBrain()
    conformance.next_wakeup = step.brain
    for line in conformance.lines(*[int(argument) for argument in sys.argv[1:]]):
        print(line)
