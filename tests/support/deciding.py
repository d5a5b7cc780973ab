"""Random programs of a leader that decides: conditions, counters, functions and what it tells its followers."""

from hypothesis import strategies as st

from motorcade import Followers, Program
from motorcade.config.profile import Profile
from motorcade.program.conditions import (
    COMPARISONS,
    SENSES,
    All,
    AnyOf,
    Chance,
    Condition,
    Counted,
    Not,
    condition_of,
)
from motorcade.program.flow_steps import ChangeStep, DoStep, FlowStep, IfStep, SetStep, TellStep
from motorcade.program.steps import SIMPLE_KINDS, RepeatStep, Step, TogetherStep
from motorcade.words.flow import CONDITIONS, OPS
from support.strategies import CLASSROOM, made, rows, single_steps, sums, togethers

NAMES = st.sampled_from(["laps", "圈数", "a", "left_to_do"])
COUNTS = st.integers(0, 255)
SENSED = st.sampled_from([condition_of({sense: level}) for sense, levels in SENSES.items() for level in levels])
ATOMS = st.one_of(
    SENSED,
    st.builds(Counted, NAMES, st.sampled_from(COMPARISONS), COUNTS),
    st.builds(Chance, st.integers(1, 99)),
)
# What may end a step: one sense, perhaps with not.
ENDINGS = SENSED | SENSED.map(Not)


def conditions() -> st.SearchStrategy[Condition]:
    """Conditions of all kinds, in one another."""

    def several(inner: st.SearchStrategy[Condition]) -> st.SearchStrategy[Condition]:
        parts = st.lists(inner, min_size=1, max_size=3).map(tuple)
        return st.builds(Not, inner) | st.builds(All, parts) | st.builds(AnyOf, parts)

    return st.recursive(ATOMS, several, max_leaves=5)


@st.composite
def ended_togethers(draw: st.DrawFn, /, seconds: st.SearchStrategy[float], **more: st.SearchStrategy) -> TogetherStep:
    """Steps of different groups at once, until a condition holds; each with a time of its own, or without."""
    groups: dict[str, list[st.SearchStrategy[Step]]] = {}
    for kind in SIMPLE_KINDS:
        groups.setdefault(kind.group, []).append(made(kind, st.none() if kind.accompanies else st.none() | seconds))
    chosen = draw(st.lists(st.sampled_from(sorted(groups)), unique=True, min_size=1))
    parts = tuple(draw(st.one_of(groups[group])) for group in chosen)
    return TogetherStep(parts, until=draw(ENDINGS), **{key: draw(value) for key, value in more.items()})


def leaders(profile: Profile = CLASSROOM, **more: st.SearchStrategy) -> st.SearchStrategy[list[Step]]:
    """Steps of a leader that decides, in one another."""
    seconds = sums(profile)
    told = single_steps(seconds) | togethers(seconds)
    plain = st.one_of(
        single_steps(seconds, **more),
        *(made(kind, st.none() | seconds, until=ENDINGS, **more) for kind in SIMPLE_KINDS),
        togethers(seconds, **more),
        ended_togethers(seconds, **more),
        st.builds(SetStep, NAMES, COUNTS, **more),
        st.builds(SetStep, NAMES, random=COUNTS, **more),
        st.builds(ChangeStep, NAMES, st.integers(-255, 255), **more),
        st.builds(TellStep, st.none() | told, **more),
        st.builds(DoStep, st.sampled_from(["dance", "绕圈"]), **more),
        flows(**more),
    )

    def holding(inner: st.SearchStrategy[Step]) -> st.SearchStrategy[Step]:
        steps = st.lists(inner, max_size=3).map(tuple)
        return st.one_of(
            st.builds(IfStep, conditions(), steps, steps, **more),
            st.builds(RepeatStep, st.integers(1, 9), steps, **more),
            st.builds(RepeatStep, st.none(), steps, until=conditions(), **more),
            st.builds(RepeatStep, st.none(), steps, **more),
        )

    return st.lists(st.recursive(plain, holding, max_leaves=6), max_size=4)


def flows(**more: st.SearchStrategy) -> st.SearchStrategy[FlowStep]:
    """Flow words with any fields."""
    return st.builds(
        FlowStep,
        op=st.sampled_from([name for _, name in OPS]),
        target=COUNTS,
        condition=st.sampled_from([name for _, name in CONDITIONS]),
        if_not=st.integers(0, 1),
        level=st.integers(0, 3),
        counter=st.integers(0, 3),
        value=COUNTS,
        **more,
    )


def deciding_programs(profile: Profile = CLASSROOM) -> st.SearchStrategy[Program]:
    """Programs of a leader that decides which say all that a project file can say; not every one can be compiled."""
    ids = st.none() | st.text(max_size=3)
    steps = leaders(profile, id=ids)
    followers = st.builds(Followers, rows(sums(profile), id=ids))
    functions = st.dictionaries(st.sampled_from(["dance", "绕圈"]), steps, max_size=2)
    return st.builds(Program, steps, st.none() | followers, st.just(profile.name), functions=functions)
