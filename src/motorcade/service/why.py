"""Why a car does what it does: what it heard, or what keeps it from hearing anything, and what would change that."""

from typing import Any, Literal, NamedTuple

from motorcade.errors import Phrase
from motorcade.service.world_messages import ReceivedFrame

# As `motorcade.engine.channel` tells it.
Reach = Literal["reaches", "too-far", "outside-beam", "hidden"]

# The losses that flipped bits cause.
_DAMAGED = ("parity", "check", "reserved")


class Sender(NamedTuple):
    """A car that sends frames, or could pass some on: how far it is, and whether it reaches the car in question.

    Where several things prevent that, ``reach`` is what is left if the distance is taken away.
    """

    car: int
    distance_mm: int
    reach: Reach


class Facts(NamedTuple):
    """What is known of a car at a moment of a run.

    Attributes:
        leads, driven: whether it runs its own program, or somebody drives it.
        followers_words: how many words the image has for followers.
        leaders: how many cars lead.
        t_ms: the time since the run began; in the first round nobody has to have heard anything.
        senders: the cars that have sent frames.
        listeners: the cars that heard some and do not pass them on.
        lost: how many frames reached the car and were lost, by reason.
        last_frame: the last one that it received.
    """

    leads: bool
    driven: bool
    followers_words: int
    leaders: int
    t_ms: int
    range_mm: int
    senders: tuple[Sender, ...]
    listeners: tuple[Sender, ...]
    lost: dict[str, int]
    last_frame: ReceivedFrame | None


class Cause(NamedTuple):
    """The answer.

    Attributes:
        phrase: its sentence.
        cure: what would change it: a range in mm, ``followers`` (they need blocks), ``leader`` (one is needed),
            ``forward`` (the cars between pass words on), ``move`` (this car beside the one that sends), ``loss`` (no
            bits flip on the way); "" where nothing is wrong or no single thing is at fault.
        value: of the cure, where it has one.
    """

    phrase: Phrase
    cure: Literal["", "range_mm", "followers", "leader", "forward", "move", "loss"] = ""
    value: int = 0


def why(facts: Facts) -> Cause:
    """Return why a car does what it does; the first cause without whose removal no other matters."""
    if facts.driven:
        return Cause(Phrase("why-driven"))
    if facts.leads:
        return Cause(Phrase("why-leads"))
    if facts.last_frame is not None:
        heard = facts.last_frame
        return Cause(Phrase("why-heard", car=heard.car, seconds=_seconds(facts.t_ms - heard.t_ms)))
    if facts.leaders == 0:
        return Cause(Phrase("why-no-leader"), "leader")
    if facts.followers_words == 0:
        return Cause(Phrase("why-no-words"), "followers")
    if not facts.senders:
        return Cause(Phrase("why-nothing-sent"))
    if any(facts.lost.values()):
        reason = max(facts.lost, key=lambda name: facts.lost[name])
        phrase = Phrase("why-lost", count=sum(facts.lost.values()), reason=Phrase(f"lost-{reason}"))
        return Cause(phrase, "loss" if reason in _DAMAGED else "")
    return _out_of_reach(facts)


def _out_of_reach(facts: Facts) -> Cause:
    """Return why no frame reaches the car."""
    between = next((each for each in facts.listeners if each.reach == "reaches"), None)
    if between:
        return Cause(Phrase("why-not-passed-on", car=between.car), "forward")
    nearest = min(facts.senders, key=lambda each: each.distance_mm)
    details = {"car": nearest.car, "metres": f"{nearest.distance_mm / 1000:.2f}"}
    if nearest.reach == "too-far":
        value = nearest.distance_mm + 1
        return Cause(Phrase("why-too-far", **details, range=f"{facts.range_mm / 1000:g}"), "range_mm", value)
    if nearest.reach == "hidden":
        return Cause(Phrase("why-hidden", **details), "move")
    if nearest.reach == "outside-beam":
        return Cause(Phrase("why-outside-beam", **details), "move")
    return Cause(Phrase("why-not-yet", **details))


def _seconds(ms: int) -> Any:
    return f"{ms / 1000:.1f}"
