"""A page's session with its world, without I/O: messages and real time in, answers and pictures out.

It lets the world's time pass, stores its past, and makes pictures of it. Real time is an argument.
"""

import math
from collections.abc import Callable, Sequence

from motorcade.engine.moment import EVENT_BYTES
from motorcade.errors import MotorcadeError
from motorcade.service import world_messages
from motorcade.service.breakpoints import LOOK_MS, Breakpoints
from motorcade.service.history import (
    EVERY_MS,
    FIRST,
    LATELY_MS,
    MOST_EVENTS,
    PAST,
    PAST_BYTES,
    History,
    Timed,
    pack_picture,
)
from motorcade.service.studio_world import StudioWorld
from motorcade.service.thoughts import Thinking
from motorcade.service.world_messages import (
    CarDetails,
    CarThought,
    Decided,
    Decisions,
    Goals,
    State,
    StopCondition,
    Thoughts,
    WorldAnswer,
    WorldHello,
    WorldMessage,
)

PICTURE_S = 1 / 30
# The session makes no more pictures while the page has received so many that it has not drawn yet.
MOST_PICTURES_UNDER_WAY = 2
STATE_S = 0.25
CAR_S = 0.1
# What the cars that are told of think, and what all others do.
THOUGHTS_S = 0.1
ALL_THOUGHTS_S = 0.4
# A page that has drawn nothing for so long is in the background: its world goes on in longer steps, which cost less.
HIDDEN_AFTER_S = 2.0
HIDDEN_STEP_S = 0.2
# A world that is late catches up with at most so much real time; the rest is dropped, so the world runs slower.
_MOST_BEHIND_S = 0.25
# Over about so much real time the speed is measured.
_RATED_S = 1.0
# The clock of a world wraps a little later.
_LAST_MS = (1 << 30) - 100_000


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
        playing: whether the world's time goes on.
        speed: simulated seconds in a real one.
        has_news: whether there is something new to show.
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
        self.playing = self.has_news = False
        # Why the world can't go on; the page is told once.
        self._problem: MotorcadeError | None = None
        self.speed = 1.0
        self._world: StudioWorld | None = None
        self._watched: int | None = None
        self._due_s = self._state_due_s = self._car_due_s = float("-inf")
        self._thoughts_due_s = self._all_thoughts_due_s = float("-inf")
        # When the page was last seen to draw.
        self._drew_s = float("-inf")
        # The numbers of the newest picture, and of the newest one that the page has drawn.
        self._numbered = self._drawn = 0
        self._told_goals: Goals | None = None
        self._told_thoughts: list[CarThought] = []
        self._told_decisions: list[Decided] = []
        self._advanced_s: float | None = None
        self._shown_ms: int | None = None
        self._history = History(past_bytes)

    @property
    def has_world(self) -> bool:
        """Whether the page has set a world; without one most methods raise MotorcadeError."""
        return self._world is not None

    @property
    def world(self) -> StudioWorld:
        """The world in play. Raises MotorcadeError where there is none."""
        if self._world is None:
            raise MotorcadeError("no-world")
        return self._world

    # The conversation.

    def connect(self) -> list[WorldAnswer]:
        """Begin a connection; pictures are numbered from 1 again."""
        self._numbered = self._drawn = 0
        return self._greet(resumed=self.has_world)

    def begin(self, world: StudioWorld) -> list[WorldAnswer]:
        """Play a new world, which `make_world` built, instead of the one before; it is paused at first."""
        self._world = world
        self._watched = None
        self.speed = 1.0
        self._begin_run(())
        return self._greet(resumed=False)

    def _greet(self, resumed: bool) -> list[WorldAnswer]:
        if not self.has_world:
            return [WorldHello(self.key, resumed, 0)]
        self._show_all()
        self._told_goals = None
        self._told_thoughts = []
        self._told_decisions = []
        news = [*self._new_goals(), *self._new_thoughts(), *self._new_decisions()]
        return [self.world.hello(self.key, resumed), self.state(), *news]

    def _new_thoughts(self, *, at_all: bool = True) -> list[WorldAnswer]:
        """What cars think at the shown time, where that has changed; see `Thinking.look`."""
        if self._shown_ms is None:
            thoughts = self._thinking.look(at_all=at_all)
        else:
            thoughts = self._thinking.told.then(self._shown_ms)
        if thoughts == self._told_thoughts:
            return []
        self._told_thoughts = thoughts
        return [Thoughts(thoughts)]

    def _new_decisions(self) -> list[WorldAnswer]:
        """What leaders have decided at the shown time, where that has changed."""
        if self._shown_ms is None:
            self._decided.keep(self.world.now_ms, self.world.deciding.look())
            leaders = self._decided.now
        else:
            leaders = self._decided.then(self._shown_ms)
        if leaders == self._told_decisions:
            return []
        self._told_decisions = leaders
        return [Decisions(leaders)]

    def _new_goals(self) -> list[WorldAnswer]:
        """How it stands with the mission's goals at the shown time, where that has changed."""
        goals = None
        if self.world.referee:
            goals = self.world.referee.goals(self._shown_ms)
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
        self._apply(message, self.world)
        answers = [self.state(), *self._breakpoints.take(), *self._new_goals()]
        # Who drags a car sends many messages; a step is seen as a whole.
        answers += self._new_thoughts(at_all=isinstance(message, world_messages.StepWorld))
        answers += self._new_decisions()
        if car := self.car():
            answers.append(car)
        return answers

    def _apply(self, message: WorldMessage, world: StudioWorld) -> None:
        match message:
            case world_messages.Play():
                self.play(message.speed)
            case world_messages.Pause():
                self.pause()
            case world_messages.StepWorld():
                self.pause()
                self.seek(None)
                self._run(message.ticks)
            case world_messages.Reset():
                self._reset(message.seed)
                self._run(message.until_ms // world.tick_ms)
                self._show_all()
            case world_messages.StopWhen():
                self._breakpoints = Breakpoints(world, message.conditions)
            case world_messages.Speak():
                world.simulation.say(message.word)
            case world_messages.SetEnvironment():
                world.set_environment(message.mat, message.range_mm)
                self.has_news = True
            case world_messages.Move():
                world.move(message.car, message.x_m, message.y_m, message.heading_deg)
                self.seek(None)
            case world_messages.Watch():
                if message.car is not None:
                    world.check_car(message.car)
                self._watched = message.car
            case world_messages.Seek():
                self.seek(message.t_ms)

    def wait_s(self, now_s: float) -> float | None:
        """After how many seconds `advance` is to be called; None: not before the next message."""
        if self.playing or self.has_news:
            return max(self._due_s - now_s, 0.0)
        return None

    def advance(self, now_s: float) -> list[WorldAnswer | bytes]:
        """Simulate what is due at ``now_s`` (seconds since any moment); return what is to be sent."""
        if not self.has_world:
            return []
        may_show = self._numbered - self._drawn < MOST_PICTURES_UNDER_WAY
        if may_show:
            self._drew_s = now_s
        is_hidden = now_s - self._drew_s >= HIDDEN_AFTER_S
        step_s = PICTURE_S
        if is_hidden:
            step_s = HIDDEN_STEP_S
        self._due_s = max(self._due_s + step_s, now_s)
        was_playing = self.playing
        self.simulate(now_s)
        if was_playing and not self.playing:
            # A world that has stopped by itself says so at once: nothing else may be due for long.
            self._state_due_s = now_s
        answers: list[WorldAnswer | bytes] = []
        if self._problem:
            answers.append(refused(self._problem))
            self._problem = None
        if self.has_news and may_show:
            self._numbered += 1
            answers.append(self.picture(self._numbered))
        if now_s >= self._state_due_s:
            self._state_due_s = now_s + STATE_S
            answers.append(self.state())
            answers += self._breakpoints.take()
            answers += self._new_goals()
        if now_s >= self._car_due_s and (car := self.car()):
            self._car_due_s = now_s + CAR_S
            answers.append(car)
        if now_s >= self._thoughts_due_s and not is_hidden:
            self._thoughts_due_s = now_s + THOUGHTS_S
            at_all = now_s >= self._all_thoughts_due_s
            if at_all:
                self._all_thoughts_due_s = now_s + ALL_THOUGHTS_S
            answers += self._new_thoughts(at_all=at_all)
            answers += self._new_decisions()
        return answers

    # Time.

    def play(self, speed: float | None = None) -> None:
        """Go on from the present, ``speed`` simulated seconds in a real one; after a mission's end begin again."""
        if self._is_over:
            self._reset(self.world.simulation.seeds[0])
        self.speed = speed or self.speed
        self.seek(None)
        self.playing = True

    def pause(self) -> None:
        """Stop the world's time."""
        self.playing = False
        self._advanced_s = None

    def seek(self, t_ms: int | None) -> None:
        """Show the stored moment at a time, and stop the world's time; None: show the present."""
        self.has_news = True
        self._shown_ms = None
        if t_ms is not None:
            self._shown_ms = self._history.moment_at(t_ms)[0]
            self.pause()

    def _reset(self, seed: int) -> None:
        """Begin again with a seed; what is around the cars stays as it is."""
        self.world.reset(seed)
        self._begin_run(self._breakpoints.conditions)

    def _begin_run(self, conditions: Sequence[StopCondition]) -> None:
        self.playing = False
        self._problem = None
        # The real time of the last `simulate`, and the simulated time that was due then but is not simulated yet.
        self._advanced_s = None
        self._behind_ms = 0.0
        # What the last `simulate` simulated, and what the next one may simulate at most (0: no limit).
        self._ran_ms = self._most_ms = 0
        # Real and simulated time of about the last _RATED_S: older time counts less and less.
        self._real_s = self._simulated_s = 0.0
        # The time of the stored moment that is shown; None for the present.
        self._shown_ms = None
        self._history = History(self._past_bytes)
        # How many rows of events came since the last stored moment; the referee has not seen them.
        self._unseen = 0
        if self.world.referee:
            self.world.referee.restart()
        self._next_moment_ms = 0
        self._breakpoints = Breakpoints(self.world, conditions)
        self._thinking = Thinking(self.world)
        self._decided = Timed[list[Decided]]([])
        self._store_moment()
        self._show_all()

    def _show_all(self) -> None:
        """Make the next picture complete, for a page that has none yet: with as many events as fit."""
        self._next_is_first = self.has_news = True
        # So many of the newest rows of events the next picture has.
        self._unshown = MOST_EVENTS

    def simulate(self, now_s: float) -> None:
        """Simulate what is due at a real time (seconds since any moment); call it for each picture, then `adapt_to`.

        On a slow computer each call simulates less: calls stay short, and simulated time runs slower.
        """
        if not self.playing:
            return
        elapsed_s = 0.0
        if self._advanced_s is not None:
            elapsed_s = max(now_s - self._advanced_s, 0.0)
        self._advanced_s = now_s
        behind_ms = min(self._behind_ms + elapsed_s * 1000 * self.speed, _MOST_BEHIND_S * 1000 * self.speed)
        tick_ms = self.world.tick_ms
        ticks = int(min(behind_ms, self._most_ms or behind_ms) // tick_ms)
        self._ran_ms = ticks * tick_ms
        self._behind_ms = behind_ms - self._ran_ms
        fading = math.exp(-elapsed_s / _RATED_S)
        self._real_s = self._real_s * fading + elapsed_s
        self._simulated_s = self._simulated_s * fading + self._ran_ms / 1000
        was_over = self._is_over
        try:
            self._run(ticks)
        except MotorcadeError as problem:
            # A car has left the plane.
            self._problem = problem
        if self._problem or self.world.now_ms >= _LAST_MS or self._is_over != was_over:
            self.pause()

    @property
    def _is_over(self) -> bool:
        """Whether the mission's run has ended; the world may go on after that."""
        return self.world.referee is not None and self.world.referee.is_over

    def adapt_to(self, seconds: float) -> None:
        """Bound the next call of `simulate` to what fits between two pictures; the last call took ``seconds``."""
        if self.has_world and self._ran_ms:
            fits_ms = int(PICTURE_S * self._ran_ms / max(seconds, 1e-6))
            # At least a tick, so that a slow computer makes progress; a mean, as one slow call may be an accident.
            self._most_ms = max((fits_ms + self._most_ms) // 2, self.world.tick_ms)

    def _run(self, ticks: int) -> None:
        world = self.world
        was_over = self._is_over
        while ticks > 0 and self._is_over == was_over:
            until_moment = -(-(self._next_moment_ms - world.now_ms) // world.tick_ms)
            count = min(ticks, max(until_moment, 1))
            if self._breakpoints.conditions:
                count = min(count, max(LOOK_MS // world.tick_ms, 1))
            events = world.run(count * world.tick_ms)
            self._history.add_events(events)
            rows = len(events) // EVENT_BYTES
            self._unseen += rows
            self._unshown = min(self._unshown + rows, MOST_EVENTS)
            if world.now_ms >= self._next_moment_ms:
                self._store_moment()
            ticks -= count
            self.has_news = True
            if self._breakpoints.conditions and self._breakpoints.see(events):
                self.pause()
                return

    def _store_moment(self) -> None:
        now_ms = self.world.now_ms
        counts = self.world.simulation.totals()
        moment = self.world.pictures.moment(is_stored=True)
        self._history.add_moment(now_ms, moment, _lost(counts))
        if self.world.referee:
            self.world.referee.see(now_ms, moment, self._history.newest_events(self._unseen), counts["touching_ms"])
        self._unseen = 0
        while self._next_moment_ms <= now_ms:
            self._next_moment_ms += EVERY_MS

    # What is sent to a page, and what others get.

    def picture(self, number: int) -> bytes:
        """Return a picture of what is shown now, with the events since the last one (`motorcade.service.history`)."""
        self.has_news = False
        flags = FIRST if self._next_is_first else 0
        self._next_is_first = False
        cars = self.world.cars
        history = self._history
        if self._shown_ms is not None:
            t_ms, moment = history.moment_at(self._shown_ms)
            events = history.events_between(t_ms - EVERY_MS, t_ms)
            lost = history.lost_before(t_ms) - history.lost_before(t_ms - LATELY_MS)
            return pack_picture(number, flags | PAST, t_ms, cars, lost, moment, events)
        moment = self.world.pictures.moment(is_stored=False)
        events = history.newest_events(self._unshown)
        self._unshown = 0
        lost = _lost(self.world.simulation.totals()) - history.lost_before(self.world.now_ms - LATELY_MS)
        return pack_picture(number, flags, self.world.now_ms, cars, lost, moment, events)

    def state(self) -> State:
        """How time passes."""
        return State(
            playing=self.playing,
            speed=self.speed,
            t_ms=self.world.now_ms,
            shown_ms=self._shown_ms,
            earliest_ms=self._history.earliest_ms,
            seed=self.world.simulation.seeds[0],
            counts=self.world.simulation.totals(),
            rate=self._simulated_s / self._real_s if self.playing and self._real_s else 0.0,
            driven=self.world.driven(),
        )

    def car(self) -> CarDetails | None:
        """The details of the watched car at the shown time, why in the present; None where none is watched."""
        if self._watched is None:
            return None
        if self._shown_ms is None:
            return self.world.details(self._watched)
        t_ms, moment = self._history.moment_at(self._shown_ms)
        return self.world.details_then(self._watched, t_ms, moment, self._history.events_of(self._watched))

    def events(self) -> list[bytes]:
        """All stored rows of events, in batches."""
        self.world  # noqa: B018 - without one there is no past
        return self._history.events()

    def newest(self) -> tuple[int, bytes]:
        """The time and the bytes of the newest stored moment."""
        return self._history.moment_at(_LAST_MS)


def _lost(counts: dict[str, int]) -> int:
    """How many frames were lost since the beginning."""
    return counts["deaf"] + sum(count for name, count in counts.items() if name.startswith("lost_"))
