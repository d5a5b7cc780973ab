"""A page's session with its world, without I/O: messages and real time in, answers and pictures out."""

from collections.abc import Callable

from motorcade.errors import MotorcadeError
from motorcade.service import world_messages
from motorcade.service.history import PAST_BYTES, History
from motorcade.service.playback import PICTURE_S, Playback
from motorcade.service.studio_world import StudioWorld
from motorcade.service.world_messages import WorldAnswer, WorldMessage

# The session makes no more pictures while the page has received so many that it has not drawn yet.
MOST_PICTURES_UNDER_WAY = 2
STATE_S, CAR_S = 0.25, 0.1
# A page that has drawn nothing for so long is in the background: its world goes on in longer steps, which cost less.
HIDDEN_AFTER_S, HIDDEN_STEP_S = 2.0, 0.2


def refused(problem: MotorcadeError) -> world_messages.Refused:
    """Return the answer for an error."""
    return world_messages.Refused(**problem.to_dict("page"))


class WorldSession:
    """One page's world; it stays when a connection of the page ends.

    A shell calls `connect` for each connection, `receive` for each message, and `advance` whenever `wait_s` is over;
    each returns what is to be sent, in order. Pictures are bytes. A newer state, or newer details of a car, make
    older ones obsolete.

    Args:
        key: the session's name.
        make_world: builds a page's world; raises MotorcadeError. It may take seconds.
        past_bytes: how much of the past is stored, in bytes of moments and of events.

    Attributes:
        playback: None until the page has set a world.
    """

    def __init__(
        self,
        key: str,
        make_world: Callable[[world_messages.SetWorld], StudioWorld],
        past_bytes: tuple[int, int] = PAST_BYTES,
    ) -> None:
        self.key = key
        self._past_bytes = past_bytes
        self.make_world = make_world
        self.playback: Playback | None = None
        self._due_s = self._state_due_s = self._car_due_s = float("-inf")
        # When the page was last seen to draw.
        self._drew_s = float("-inf")
        # The numbers of the newest picture, and of the newest one that the page has drawn.
        self._numbered = self._drawn = 0
        self._told_goals: world_messages.Goals | None = None

    def connect(self) -> list[WorldAnswer]:
        """Begin a connection; pictures are numbered from 1 again."""
        self._numbered = self._drawn = 0
        return self._greet(resumed=self.playback is not None)

    def begin(self, world: StudioWorld) -> list[WorldAnswer]:
        """Play a new world, which `make_world` built, instead of the one before."""
        self.playback = Playback(world, History(*self._past_bytes))
        return self._greet(resumed=False)

    def _greet(self, resumed: bool) -> list[WorldAnswer]:
        if self.playback is None:
            return [world_messages.Hello(self.key, resumed, 0)]
        self.playback.show_all()
        self._told_goals = None
        return [self.playback.world.hello(self.key, resumed), self.playback.state(), *self._new_goals()]

    def _new_goals(self) -> list[WorldAnswer]:
        """How it stands with the mission's goals, where that has changed."""
        goals = self.playback.goals() if self.playback else None
        if goals is None or goals == self._told_goals:
            return []
        self._told_goals = goals
        return [goals]

    def receive(self, message: WorldMessage) -> list[WorldAnswer]:
        """Do what the page requests. Raises MotorcadeError, and changes nothing, where that isn't possible.

        A message `Shown` may be received while another thread is in `advance`. `Resume` is for the shell, which knows
        who drives; here it only returns a new state.
        """
        if isinstance(message, world_messages.Shown):
            self._drawn = max(self._drawn, min(message.frame, self._numbered))
            return []
        if isinstance(message, world_messages.SetWorld):
            return self.begin(self.make_world(message))
        playback = self.playback
        if playback is None:
            raise MotorcadeError("no-world")
        _apply(playback, message)
        car = playback.car()
        return [playback.state(), *self._new_goals(), *([car] if car else [])]

    def wait_s(self, now_s: float) -> float | None:
        """After how many seconds `advance` is to be called; None: not before the next message."""
        if self.playback is None or not (self.playback.playing or self.playback.changed):
            return None
        return max(self._due_s - now_s, 0.0)

    def advance(self, now_s: float) -> list[WorldAnswer | bytes]:
        """Simulate what is due at ``now_s`` (seconds since any moment); return what is to be sent."""
        playback = self.playback
        if playback is None:
            return []
        may_show = self._numbered - self._drawn < MOST_PICTURES_UNDER_WAY
        if may_show:
            self._drew_s = now_s
        is_hidden = now_s - self._drew_s >= HIDDEN_AFTER_S
        self._due_s = max(self._due_s + (HIDDEN_STEP_S if is_hidden else PICTURE_S), now_s)
        was_playing = playback.playing
        playback.advance(now_s)
        if was_playing and not playback.playing:
            # A world that has stopped by itself says so at once: nothing else may be due for long.
            self._state_due_s = now_s
        answers: list[WorldAnswer | bytes] = []
        if playback.changed and may_show:
            self._numbered += 1
            answers.append(playback.picture(self._numbered))
        if now_s >= self._state_due_s:
            self._state_due_s = now_s + STATE_S
            answers.append(playback.state())
            answers += self._new_goals()
        if now_s >= self._car_due_s and (car := playback.car()):
            self._car_due_s = now_s + CAR_S
            answers.append(car)
        return answers

    def adapt_to(self, seconds: float) -> None:
        """Bound the next call of `advance`, as `motorcade.service.playback.Playback.adapt_to`."""
        if self.playback:
            self.playback.adapt_to(seconds)


def _apply(playback: Playback, message: WorldMessage) -> None:
    match message:
        case world_messages.Play():
            playback.play(message.speed)
        case world_messages.Pause():
            playback.pause()
        case world_messages.Step():
            playback.step(message.ticks)
        case world_messages.Reset():
            playback.reset(message.seed)
        case world_messages.Speak():
            playback.world.speak(message.word)
        case world_messages.Furnish():
            playback.furnish(message.mat, message.range_mm)
        case world_messages.Move():
            playback.move(message.car, message.x_m, message.y_m, message.heading_deg)
        case world_messages.Watch():
            playback.watch(message.car)
        case world_messages.Seek():
            playback.seek(message.t_ms)
