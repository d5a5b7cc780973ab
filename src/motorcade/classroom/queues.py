"""Who is next: at the one cable, and at the stick of each real car."""

from collections.abc import Iterable, Sequence

from motorcade.errors import MotorcadeError


class Queue:
    """Pupils in the order in which they came; the first has what all wait for."""

    def __init__(self) -> None:
        self.pupils: list[str] = []

    def wish(self, pupil: str, wants: bool) -> None:
        """Stand at the end, or leave; who stands in it already keeps the place."""
        if not wants:
            self.leave(pupil)
        elif pupil not in self.pupils:
            self.pupils.append(pupil)

    def leave(self, pupil: str) -> None:
        """Leave at once."""
        if pupil in self.pupils:
            self.pupils.remove(pupil)

    def next(self) -> None:
        """The first one leaves."""
        del self.pupils[:1]

    @property
    def first(self) -> str | None:
        """Whose turn it is."""
        return self.pupils[0] if self.pupils else None


# A transfer of the largest image with all its retries takes less; then the cable is not what it waits for.
MOST_TRANSFER_S = 60.0


class Cable(Queue):
    """The queue for the cable: whoever sends something through it keeps the turn until that is over.

    A transfer is not broken off, so the next one would find the port taken. It holds the turn for a minute at most.
    """

    def __init__(self) -> None:
        super().__init__()
        self._sender: str | None = None
        self._began_s = 0.0
        self.is_ending = False

    @property
    def is_sending(self) -> bool:
        """Whether something is sent, and holds the turn."""
        return self._sender is not None

    def wish(self, pupil: str, wants: bool) -> None:
        """Stand at the end, or leave: who has the turn and sends something leaves afterwards."""
        if not wants and pupil == self.first and self._first_sends():
            self.is_ending = True
        else:
            super().wish(pupil, wants)

    def next(self) -> None:
        """The first one leaves, as soon as what that one sends is over."""
        if self._first_sends():
            self.is_ending = True
        else:
            super().next()

    def leave(self, pupil: str) -> None:
        """Leave at once, also while something is sent: the next one has to wait for that."""
        if pupil == self.first:
            self.is_ending = False
        super().leave(pupil)

    def check(self, pupil: str) -> None:
        """Raise MotorcadeError where it isn't a pupil's turn."""
        if self.first != pupil:
            raise MotorcadeError("cable-of-another")

    def begin(self, who: str, now_s: float) -> None:
        """Something is sent from now on, by the first one or the teacher."""
        self._sender, self._began_s = who, now_s

    def end(self, who: str) -> None:
        """What ``who`` sent has arrived, or not."""
        if who == self._sender:
            self._release()

    def advance(self, now_s: float) -> bool:
        """Wait no longer for a transfer that doesn't end; return whether there was one."""
        late = self.is_sending and now_s - self._began_s >= MOST_TRANSFER_S
        if late:
            self._release()
        return late

    def _first_sends(self) -> bool:
        return self.is_sending and self._sender == self.first

    def _release(self) -> None:
        self._sender = None
        if self.is_ending:
            self.is_ending = False
            super().next()


class Turns(Queue):
    """A queue whose first one drives a car; after a turn the next one does, if somebody waits."""

    def __init__(self) -> None:
        super().__init__()
        self._driver: str | None = None
        self._began_s = 0.0

    def advance(self, now_s: float, turn_s: float) -> bool:
        """End the turn that is over; return whether somebody else drives now."""
        before = self._driver
        if self.first == before and before is not None and len(self.pupils) > 1 and now_s - self._began_s >= turn_s:
            self.next()
        if self.first != self._driver:
            self._driver, self._began_s = self.first, now_s
        return self._driver != before

    def left_s(self, now_s: float, turn_s: float) -> float:
        """How much of the turn is left; 0 where it goes on only because nobody waits."""
        return max(turn_s - (now_s - self._began_s), 0.0) if self.first else 0.0


def car_turns(cars: Iterable[str]) -> dict[str, Turns]:
    """A queue for each car."""
    return {car: Turns() for car in cars}


def leave_all(queues: Sequence[Queue], pupil: str) -> None:
    """A pupil leaves all queues."""
    for queue in queues:
        queue.leave(pupil)
