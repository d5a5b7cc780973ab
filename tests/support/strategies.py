"""Random programs and images, and two kinds of cars to run them on."""

from dataclasses import replace
from typing import Any

from hypothesis import strategies as st

from motorcade import Followers, Program
from motorcade.car.brain import FORWARD, LEFT, RANDOM_FORWARD, RIGHT
from motorcade.config.profile import Profile, built_in_profile
from motorcade.program.conditions import any_of, heard, obstacle, person
from motorcade.program.steps import SIMPLE_KINDS, DrivingStep, RepeatStep, Step, TogetherStep, own_fields
from motorcade.words.formats import CONTROL
from motorcade.words.image import Image, image_words
from motorcade.words.infrared import TAGS, tagged_frame
from motorcade.words.packing import words_to_bytes

CLASSROOM = built_in_profile("classroom")
# The same cars in a hurry: as many cases in less than half of the simulated time.
BRISK = replace(
    CLASSROOM,
    durations_ms=(0, 400, 800, 1200),
    dwell_ms=tuple(400 * (level + 1) for level in range(8)),
    infrared=replace(CLASSROOM.infrared, forget_ms=6000),
)

LEVELS = st.integers(0, 3)


def sums(profile: Profile, most: int = 3, least: int = 0) -> st.SearchStrategy[float]:
    """Seconds that ``least`` to ``most`` duration levels above 0 add up to."""
    levels = st.lists(st.sampled_from(profile.durations_ms[1:]), min_size=least, max_size=most)
    return levels.map(lambda chosen: sum(chosen) / 1000)


def made(
    kind: type[Step], seconds: st.SearchStrategy[float | None], **more: st.SearchStrategy
) -> st.SearchStrategy[Step]:
    """Steps of one kind, each field as its schema allows."""
    fields = {}
    for each in own_fields(kind):
        schema = each.metadata["schema"]
        levels = st.integers(schema.get("minimum", 0), schema.get("maximum", 0))
        others = st.sampled_from(schema["enum"]) if "enum" in schema else levels
        fields[each.name] = seconds if each.name == "seconds" else others
    return st.builds(kind, **fields, **more)


def single_steps(seconds: st.SearchStrategy[float], **more: st.SearchStrategy) -> st.SearchStrategy[Step]:
    """Steps that are no list of others; those that drive mind something or nothing."""
    return st.one_of([made(kind, seconds, **more, **_minding(kind)) for kind in SIMPLE_KINDS])


def _minding(kind: type[Step]) -> dict[str, st.SearchStrategy]:
    senses = [st.just(person()), st.just(heard()), st.sampled_from([*map(obstacle, range(4))])]
    several = st.lists(st.sampled_from(senses), min_size=1, unique_by=id).flatmap(lambda chosen: st.tuples(*chosen))
    return {"unless": st.none() | several.map(any_of)} if issubclass(kind, DrivingStep) else {}


@st.composite
def togethers(draw: st.DrawFn, /, seconds: st.SearchStrategy[float], **more: st.SearchStrategy) -> TogetherStep:
    """Steps of different groups at once, in any order."""
    groups: dict[str, list[st.SearchStrategy[Step]]] = {}
    for kind in SIMPLE_KINDS:
        groups.setdefault(kind.group, []).append(made(kind, st.none() if kind.accompanies else seconds))
    chosen = draw(st.lists(st.sampled_from(sorted(groups)), unique=True))
    parts = tuple(draw(st.one_of(groups[group])) for group in chosen)
    return TogetherStep(parts, **{key: draw(value) for key, value in more.items()})


def rows(
    seconds: st.SearchStrategy[float], most: int = 4, least: int = 0, **more: st.SearchStrategy
) -> st.SearchStrategy[list[Step]]:
    """Steps one behind the other, some of them repeated."""
    plain = st.one_of(single_steps(seconds, **more), togethers(seconds, **more))
    inner = st.lists(plain, min_size=least, max_size=2).map(tuple)
    repeats = st.builds(RepeatStep, st.integers(1, 3), inner, **more)
    return st.lists(st.one_of(plain, plain, repeats), min_size=least, max_size=most)


def programs(profile: Profile = CLASSROOM) -> st.SearchStrategy[Program]:
    """Programs that say all that a project file can say; not every one can be compiled."""
    seconds = sums(profile)
    flags = st.none() | st.booleans()
    ids = st.none() | st.text(max_size=3)
    followers = st.builds(
        Followers,
        rows(seconds, id=ids, accept_ir=flags, forward=flags),
        st.booleans(),
        st.booleans(),
        st.none() | st.sampled_from(profile.dwell_ms).map(lambda dwell: dwell / 1000),
        st.sampled_from(["auto", True, False]),
    )
    return st.builds(Program, rows(seconds, id=ids), st.none() | followers, st.just(profile.name))


# Half characters (surrogates) and numbers beyond JSON's are among them.
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(st.characters(), max_size=5),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(st.characters(), max_size=5), inner, max_size=3)
    ),
    max_leaves=6,
)


@st.composite
def damaged_documents(draw: st.DrawFn) -> dict[str, Any]:
    """A program's document in which something was replaced, added or taken away."""
    document = draw(programs()).as_dict()
    places: list[Any] = [document]
    for place in places:
        inner = place.values() if isinstance(place, dict) else place
        places.extend(each for each in inner if isinstance(each, (dict, list)) and each)
    place = draw(st.sampled_from(places))
    key = draw(st.sampled_from(list(place) if isinstance(place, dict) else range(len(place))))
    if draw(st.booleans()):
        place[key] = draw(JSON | st.sampled_from([0, -1, 1e9, 10**30, {}, [], "id"]))
    elif isinstance(place, dict) and draw(st.booleans()):
        other = st.sampled_from(["id", "wait", "led", "steps", "seconds", "times", "speed"])
        place[draw(other)] = place.pop(key)
    else:
        del place[key]
    return document


@st.composite
def words(draw: st.DrawFn, leads: bool = False) -> int:
    """Any control word of an image, whatever a compiler would say of it."""
    usual = st.sampled_from([1, 1, 1, 0])
    motor, avoids, led = draw(usual), draw(usual), draw(usual)
    levels = st.sampled_from([3, 2, 1, 0])
    is_deaf = leads or draw(st.integers(0, 7)) == 7
    return CONTROL.encode(
        accept_ir=int(not is_deaf),
        forward=int(leads or draw(st.booleans())),
        motor_enable=motor,
        motor_direction=draw(st.sampled_from([FORWARD, RANDOM_FORWARD, FORWARD, LEFT, RIGHT])) * motor,
        motor_speed=draw(levels) * motor,
        motor_duration=draw(levels) * motor,
        led_which=draw(levels) * led,
        led_duration=draw(levels) * led,
        avoid_enable=avoids,
        avoid_radius=draw(levels) * avoids,
        avoid_duration=draw(levels) * avoids,
        voice=int(draw(st.booleans())),
        pir=int(draw(st.booleans())),
        floor=int(draw(st.booleans())),
    )


def tagged_frames() -> st.SearchStrategy[int]:
    """Frames of any control word with any tag."""
    return st.builds(tagged_frame, words(), st.integers(1, TAGS))


@st.composite
def images(draw: st.DrawFn, states: int = 0, followers: int = 0) -> bytes:
    """Any image of ``states`` to four leader words, and ``followers`` to three for followers."""
    leader = draw(st.lists(words(leads=True), min_size=states, max_size=4))
    follower_words = draw(st.lists(words(), min_size=followers, max_size=3))
    tagged = draw(st.integers(0, 1)) if follower_words else 0
    return words_to_bytes(image_words(Image(leader, follower_words, draw(LEVELS), tagged)))
