"""Which of an image's words each car executes or holds, and what has happened to each."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from motorcade.car.brain import HOLDS, RUNNING, SLOT, STARTED_MS, STATE, WORD
from motorcade.engine.events import KINDS, LOSS_REASONS
from motorcade.engine.world import World
from motorcade.service.pictures import HEARD, LOST, NO_INDEX
from motorcade.words.formats import CONTROL
from motorcade.words.image import bytes_to_words
from motorcade.words.ticks import elapsed_ms

_FRAME, _HEARD, _LOST = (KINDS.index(kind) for kind in ("frame", "heard", "lost"))
_MARKED = ((_LOST, LOST), (_HEARD, HEARD))


class WordIndex:
    """The words of a world whose leaders run one image, car by car."""

    def __init__(self, world: World):
        self._world = world
        self.words: NDArray[np.uint32] = np.array(bytes_to_words(world.images[0]), np.uint32)
        self._states = int(self.words[0]) >> 24
        self._sent, self._place = np.unique(self.words[1 + self._states :], return_inverse=True)
        self._by_slot: dict[int, NDArray[np.uint16]] = {}
        self._leaders = np.flatnonzero(world.mat.starts.leads)

    def memory(self) -> NDArray[np.uint32]:
        """What the cars' brains hold, a column each, in the order of their numbers."""
        state = self._world.state
        columns: NDArray[np.uint32] = state.memory[:, np.argsort(state.number)]
        return columns

    def indices(self) -> NDArray[np.uint16]:
        """The index, among the image's words, of what each car executes or holds; NO_INDEX for none.

        Where equal words stand there several times, a follower's is the one that the leader sent last.
        """
        memory = self.memory()
        index = np.full(self._world.cars, NO_INDEX, np.uint16)
        if len(self._sent):
            slot = int(memory[SLOT, self._leaders[0]]) if len(self._leaders) else 0
            place = np.minimum(np.searchsorted(self._sent, memory[WORD]), len(self._sent) - 1)
            known = (memory[HOLDS] > 0) & (self._sent[place] == memory[WORD])
            index[known] = self._latest(slot)[place[known]]
        lead = self._leaders
        index[lead] = np.where(memory[RUNNING, lead] > 0, memory[STATE, lead] + 1, NO_INDEX)
        return index

    def _latest(self, slot: int) -> NDArray[np.uint16]:
        """For each different follower word its latest index in a round that ends with ``slot``."""
        if slot not in self._by_slot:
            count = len(self._place)
            latest = np.zeros(len(self._sent), np.uint16)
            for k in range(slot + 1, slot + 1 + count):
                latest[self._place[k % count]] = 1 + self._states + k % count
            self._by_slot[slot] = latest
        return self._by_slot[slot]

    def details(self, car: int) -> dict[str, Any]:
        """What a car holds: the word by fields, its index, and for how long."""
        s = self.memory()[:, car]
        holds = bool(s[RUNNING if self._world.mat.starts.leads[car] else HOLDS])
        word = int(s[WORD])
        return {
            "leads": bool(self._world.mat.starts.leads[car]),
            "word": f"{word:08x}" if holds else None,
            "values": CONTROL.decode(word)._asdict() if holds else None,
            "index": int(self.indices()[car]),
            "runs": bool(s[RUNNING]),
            "since_ms": elapsed_ms(self._world.now_ms, int(s[STARTED_MS])) if holds else None,
        }


class Counters:
    """What each car has sent, heard and lost, and what it heard last."""

    def __init__(self, cars: int):
        self._cars = cars
        self._frames = np.zeros(cars, np.int64)
        self._heard = np.zeros(cars, np.int64)
        self._lost = np.zeros((len(LOSS_REASONS), cars), np.int64)
        self._last = np.zeros((3, cars), np.int64)

    def take(self, events: NDArray[np.void], marks: tuple[NDArray[np.uint8], ...]) -> None:
        """Count events, and set the flags LOST and HEARD of the cars in all ``marks``."""
        cars, kinds = events["car"], events["kind"]
        for kind, flag in _MARKED:
            for mark in marks:
                mark[cars[kinds == kind]] |= flag
        self._frames += np.bincount(cars[kinds == _FRAME], minlength=self._cars)
        heard = events[kinds == _HEARD]
        self._heard += np.bincount(heard["car"], minlength=self._cars)
        for row, name in enumerate(("word", "other", "t_ms")):
            self._last[row, heard["car"]] = heard[name]
        lost = events[kinds == _LOST]
        np.add.at(self._lost, (lost["why"], lost["car"]), 1)

    def of(self, car: int) -> dict[str, Any]:
        """The counts of a car by name, and the frame that it heard last."""
        word, sender, t_ms = self._last[:, car].tolist()
        heard = int(self._heard[car])
        return {
            "frames": int(self._frames[car]),
            "heard": heard,
            "lost": {why: int(self._lost[k, car]) for k, why in enumerate(LOSS_REASONS) if why},
            "hears": {"word": f"{word:08x}", "car": sender, "t_ms": t_ms} if heard else None,
        }
