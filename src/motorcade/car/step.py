"""One tick of a car: the order of its inputs, its brain and its outputs.

Portable. The loop of a real car runs this file on CPython and MicroPython, the engine compiles it for simulated cars,
and it is translated to C, so all do the same in the same order. Each passes its own ``car``: see Turn.
"""

from motorcade.car import brain, frames
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
        def image(self) -> brain.ImageWords:
            """The words of the car's image."""

        @property
        def levels(self) -> tuple[int, ...]:
            """The profile's integers."""

        def note(self, kind: uint8, at_ms: int, word: int, detail: int) -> None:
            """Take note that a state (STATE) or a word (START) begins, or that a word's length is over (OVER).

            ``detail`` is a state's index, the tag with which a word came (0: bare), or 0.
            """

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
    """Let a leader begin its image."""
    frames.leader_begin(car.memory, car.image, now)
    if brain.leader_start(car.memory, car.image, now):
        car.note(STATE, now, car.memory[brain.WORD], 0)


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
    if car.leads:
        while brain.leader_step(s, car.image, now, levels):
            car.note(STATE, s[brain.STARTED_MS], s[brain.WORD], s[brain.STATE])
    else:
        _follow(car, now)
    voice = car.heard_voice()
    if voice != brain.NO_VOICE:
        brain.hear_voice(s, voice)
    senses = car.sense(brain.looks_mm(s, now, levels))
    wheels = brain.wheels(s, senses, now, levels)
    return car.set_outputs(wheels, senses)


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
    s = car.memory
    if car.leads:
        if frames.leader_sends(s, car.image, car.air_is_busy(), now, car.levels) == 0:
            return 0
        car.send_frame(frames.leader_frame(s, car.image))
    else:
        if frames.follower_sends(s, car.air_is_busy(), now, car.levels) == 0:
            return 0
        car.send_frame(frames.follower_frame(s))
    return 1
