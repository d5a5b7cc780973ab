"""A page at a world's session, without a shell: the test's clock, and the answers that it got."""

from collections.abc import Callable
from typing import Any

from motorcade.browser.kernels import open_worlds
from motorcade.service.studio_world import StudioWorld, open_world
from motorcade.service.world_messages import SetWorld, Shown, WorldMessage
from motorcade.service.world_session import WorldSession
from support.linear_instance import MockInstance
from support.pictures import Picture

MOST_CARS = 2_000


def server_world(message: SetWorld) -> StudioWorld:
    """Build a page's world as the studio's server does."""
    return open_world(message, MOST_CARS)


def site_world(message: SetWorld) -> StudioWorld:
    """Build a page's world as the site does, in a browser."""
    return open_world(message, MOST_CARS, open_worlds(MockInstance))


class SessionPage:
    """A page that calls its session when it is due, and draws the pictures unless it ``is_slow``.

    Attributes:
        answers: what it got, in order; pictures as `Picture`.
        steps: how often it called.
    """

    def __init__(self, make_world: Callable[[SetWorld], StudioWorld], *messages: WorldMessage) -> None:
        self.session = WorldSession("0" * 32, make_world)
        self.now_s = 0.0
        self.is_slow = False
        self.steps = 0
        self.answers: list[object] = [*self.session.connect()]
        for message in messages:
            self.send(message)

    def send(self, message: WorldMessage) -> None:
        """Send a message."""
        self.answers += self.session.receive(message)

    def look(self, seconds: float) -> None:
        """Let time pass."""
        end_s = self.now_s + seconds
        while (wait_s := self.session.wait_s(self.now_s)) is not None and self.now_s + wait_s <= end_s:
            self.now_s += wait_s
            self.steps += 1
            for answer in self.session.advance(self.now_s):
                if isinstance(answer, bytes):
                    picture = Picture(answer)
                    self.answers.append(picture)
                    if not self.is_slow:
                        self.session.receive(Shown(picture.number))
                else:
                    self.answers.append(answer)
            self.session.adapt_to(0.001)
        self.now_s = end_s

    def take(self, kind: type) -> list[Any]:
        """The answers of a kind since the last call; all others are dropped."""
        found = [answer for answer in self.answers if isinstance(answer, kind)]
        self.answers.clear()
        return found

    def last(self, kind: type) -> Any:
        """The newest answer of a kind."""
        return next(answer for answer in reversed(self.answers) if isinstance(answer, kind))
