"""All kinds of goals, by what a file calls them, in the order in which their classes are declared."""

from motorcade.missions import car_goals, event_goals, other_goals, score_goals
from motorcade.missions.goal import GoalKind

_DECLARED = [
    declared
    for module in (car_goals, event_goals, score_goals, other_goals)
    for declared in vars(module).values()
    if isinstance(declared, type) and issubclass(declared, GoalKind) and "name" in vars(declared)
]
GOALS: dict[str, type[GoalKind]] = {kind.name: kind for kind in _DECLARED}
