"""The messages of the stream ``trials``: a program is tried on other seeds, and two runs are compared."""

from typing import Annotated, Literal

from msgspec import Meta, Struct

from motorcade.service.messages import MissionChoice, Sentence
from motorcade.service.world_messages import Refused, Seed, SetWorld


class _TrialMessage(Struct, tag_field="do", tag=str.lower, forbid_unknown_fields=True):
    pass


class Try(_TrialMessage):
    """Run a mission on other seeds than its own, with this image; what was tried before ends."""

    mission: MissionChoice
    image: bytes
    runs: Annotated[int, Meta(ge=1, le=200)] = 200


class Explain(_TrialMessage):
    """Say what went wrong in a run that was tried."""

    seed: Seed


class Compare(_TrialMessage):
    """Find where two runs part; what was compared before ends."""

    one: SetWorld
    other: SetWorld
    until_ms: Annotated[int, Meta(ge=100, le=600_000)] = 60_000


class Show(_TrialMessage):
    """Send a picture of each of the two runs at a time."""

    t_ms: Annotated[int, Meta(ge=0, lt=1 << 30)]


TrialMessage = Try | Explain | Compare | Show


class _TrialAnswer(Struct, tag_field="is", tag=str.lower):
    pass


class Luck(_TrialAnswer):
    """In how many runs the goals of the first star were met.

    Attributes:
        works: in so many of those ``tried`` so far.
        of: how many runs there will be.
        failed: the seeds of the others.
    """

    works: int
    tried: int
    of: int
    failed: list[int]


class Failure(_TrialAnswer):
    """What went wrong in a run: at ``t_ms`` one can see it, and ``cars`` are the cars that ``why`` is about."""

    seed: int
    t_ms: int
    why: Sentence
    cars: list[int]


class BegunWord(Struct):
    """A word that a car began, as eight hexadecimal digits."""

    t_ms: int
    word: str


class Difference(_TrialAnswer):
    """Where two runs part.

    Attributes:
        kind: ``word``: a car begins a word in one run and not in the other; ``place``: words are the same, but a car
            comes to stand elsewhere; ``none``: neither; the runs may still differ in what nobody sees.
        t_ms: when.
        car: which car.
        missed: of ``word``, the run, 0 or 1, in which the car does not begin the word; None: it begins another one.
        late_ms: how much later it begins the word in the run ``missed``; None: not at all, as far as is known.
        words: of ``word``, the word that it begins in each run.
        cause: why, where the engine's events say it.
        exact_ms, exact_car: the first tick in which anything differs, and in which car; None: nothing does.
        begun: the words that this car begins in each run, around that time.
        until_ms: both runs are simulated until then.
    """

    kind: Literal["word", "place", "none"]
    t_ms: int
    car: int
    missed: int | None
    late_ms: int | None
    words: list[str | None]
    cause: Sentence | None
    exact_ms: int | None
    exact_car: int | None
    begun: list[list[BegunWord]]
    until_ms: int


class Compared(_TrialAnswer):
    """How far two runs are simulated."""

    t_ms: int


TrialAnswer = Luck | Failure | Difference | Compared | Refused
