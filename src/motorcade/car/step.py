"""One tick of a car: the order of its inputs, its brain and its outputs.

Portable. The loop of a real car runs this file on CPython and MicroPython, the engine compiles it for simulated cars,
and it is translated to C, so all do the same in the same order. Each passes its own ``car``: see Turn.
"""

from motorcade.car import brain, decisions, frames
from motorcade.words import uint8
from motorcade.words.ticks import later_ms

# For the type checker and the translation to C alone: MicroPython has no such modules.
MYPY = False
if MYPY:
    from collections.abc import Iterable
    from typing import Any, Protocol

    # A record with the fields of motorcade.car.senses.Senses; the engine's has more.
    Senses = Any
    Done = Any

    class Turn(Protocol):
        """A car whose turn it is."""

        @property
        def leads(self) -> bool:
            """Whether the car leads or follows."""

        @property
        def memory(self) -> list[int]:
            """The argument ``s`` of `motorcade.car.brain`."""

        @property
        def decisions(self) -> bytearray:
            """The argument ``d`` of `motorcade.car.decisions`; a follower needs none."""

        @property
        def image(self) -> brain.ImageWords:
            """The words of the car's image."""

        @property
        def levels(self) -> tuple[int, ...]:
            """The profile's integers."""

        def note(self, kind: uint8, at_ms: int, word: int, detail: int) -> None:
            """Take note that a state (STATE) or a word (START) begins, or that a word's length is over (OVER).

            ``detail`` is a state's index, the tag with which a word came (0: bare), or 0.
            """

        @property
        def notes_flow(self) -> uint8:
            """1 where ``note_flow`` is to be called, which takes time, else 0."""

        def note_end(self) -> None:
            """Take note that the condition of the running state ends it now."""

        def note_flow(self, index: uint8) -> None:
            """Take note that the flow word with this index was executed."""

        def received_frames(self) -> Iterable[int]:
            """Return the infrared frames that ended since the last tick, in order."""

        def note_frame(self, frame: int, result: uint8) -> None:
            """Take note of the result of `motorcade.car.frames.follower_hears` for such a frame."""

        def heard_voice(self) -> uint8:
            """Return the voice command since the last tick, NO_VOICE for none."""

        def sense(self, looks_mm: int) -> Senses:
            """Read the sensors.

            With ``looks_mm`` 0 no obstacle matters and the ultrasonic sensor stays off. The record may have further
            fields; ``set_outputs`` gets them all.
            """

        def set_outputs(self, wheels: uint8, senses: Senses) -> Done:
            """Set the wheels, and what follows from the memory alone, such as the LED.

            `motorcade.car.brain` gives the state of the wheels (``wheels``) and the LED (``lit_led``); ``senses`` is
            what ``sense`` returned.
            """

        def air_is_busy(self) -> uint8:
            """Return 1 while infrared of any car, this one included, is on the air here, else 0."""

        def send_frame(self, frame: int) -> None:
            """Begin to send the 32 bits of ``frame`` by infrared."""


# Kinds of the events that a car notes.
STATE = 0
START = 1
OVER = 2


def begin_program(car: "Turn", now: int) -> None:
    """Let a leader begin its image, which `motorcade.car.decisions.survey` has seen."""
    s = car.memory
    if decisions.decides(car.decisions):
        decisions.begin(s, car.decisions, now)
        if car.decisions[decisions.TELLS] == 0:
            frames.leader_begin(s, car.image, now)
    else:
        frames.leader_begin(s, car.image, now)
        if brain.leader_start(s, car.image, now):
            car.note(STATE, now, s[brain.WORD], 0)


def step(car: "Turn", now: int) -> None:
    """Do all that is due at ``now``."""
    act(car, now)
    send(car, now)


def act(car: "Turn", now: int) -> "Done":
    """Go on with the program or the word, take what was received, and set wheels and LED.

    Returns:
        What ``car.set_outputs`` returns.
    """
    s = car.memory
    levels = car.levels
    if car.leads and decisions.decides(car.decisions):
        senses = _decide(car, now)
    else:
        senses = _go_on(car, now)
    wheels = brain.wheels(s, senses, now, levels)
    return car.set_outputs(wheels, senses)


def _go_on(car: "Turn", now: int) -> "Senses":
    """Go on with the program or the word, and take what was received; return what is sensed then."""
    s = car.memory
    levels = car.levels
    if car.leads:
        while brain.leader_step(s, car.image, now, levels):
            car.note(STATE, s[brain.STARTED_MS], s[brain.WORD], s[brain.STATE])
    else:
        _follow(car, now)
    voice = car.heard_voice()
    if voice != brain.NO_VOICE:
        brain.hear_voice(s, voice)
    return car.sense(brain.looks_mm(s, now, levels))


def _decide(car: "Turn", now: int) -> "Senses":
    """Sense first, and go on with the words of a leader that decides by that; return what was sensed."""
    s = car.memory
    d = car.decisions
    levels = car.levels
    voice = car.heard_voice()
    if voice != brain.NO_VOICE:
        brain.hear_voice(s, voice)
        decisions.hear_voice(d, voice)
    senses = car.sense(decisions.looks_mm(d, levels))
    if d[decisions.TELLS]:
        decisions.change_slot(s, d, car.image, now, levels)
    if decisions.ends_early(s, d, senses, levels):
        car.note_end()
        brain.break_off(s, now, levels)
    decisions.begin_tick(s, d, now)
    done = decisions.EXECUTED
    while done != decisions.DONE:
        index = d[decisions.NEXT]
        done = decisions.go_on(s, d, car.image, senses, now, levels, car.notes_flow)
        if done == decisions.BEGUN:
            car.note(STATE, s[brain.STARTED_MS], s[brain.WORD], s[brain.STATE])
        if done == decisions.EXECUTED:
            car.note_flow(index)
    return senses


def _follow(car: "Turn", now: int) -> None:
    s = car.memory
    levels = car.levels
    if brain.follower_step(s, now, levels):
        over_ms = later_ms(s[brain.STARTED_MS], brain.length_ms(s[brain.WORD], levels))
        car.note(OVER, over_ms, s[brain.WORD], 0)
    for frame in car.received_frames():
        result = frames.follower_hears(s, frame, now, levels)
        car.note_frame(frame, result)
        if result == frames.BEGUN:
            car.note(START, now, s[brain.WORD], s[brain.TAG] & brain.TAG_MASK)


def send(car: "Turn", now: int) -> uint8:
    """Begin the frame that is due, if one is; call it after ``act``. Return 1 where a frame was begun, else 0."""
    frame = _frame(car, now)
    if frame == frames.NO_FRAME:
        return 0
    car.send_frame(frame)
    return 1


def _frame(car: "Turn", now: int) -> int:
    if car.leads:
        if car.decisions[decisions.TELLS]:
            return decisions.leader_frame(car.memory, car.decisions, car.image, car.air_is_busy(), now, car.levels)
        return frames.leader_frame(car.memory, car.image, car.air_is_busy(), now, car.levels)
    return frames.follower_frame(car.memory, car.air_is_busy(), now, car.levels)
