"""Who is next: at the one cable, and at the stick of each real car."""

from collections.abc import Iterable, Sequence


class Queue:
    """Pupils in the order in which they came; the first has what all wait for."""

    def __init__(self) -> None:
        self.pupils: list[str] = []

    def wish(self, pupil: str, wants: bool) -> None:
        """Stand at the end, or leave; who stands in it already keeps the place."""
        if wants and pupil not in self.pupils:
            self.pupils.append(pupil)
        elif not wants and pupil in self.pupils:
            self.pupils.remove(pupil)

    def next(self) -> None:
        """The first one leaves."""
        del self.pupils[:1]

    @property
    def first(self) -> str | None:
        """Whose turn it is."""
        return self.pupils[0] if self.pupils else None


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
        queue.wish(pupil, False)
