"""A laboratory for those who study swarms: sweeps, environments for learning, capsules, and the search for programs.

A sweep is many programs, mats, parameters and seeds in one table. `spec` reads its specification and knows what can
vary, `plan` divides the runs into tasks, `task` does one, `run` does all of them, on this computer or on a cluster, and
`capsule` packs a sweep so that others can repeat it. `environments` are worlds for programs that learn. `search` finds
programs for a mission, whose runs `grading` judges. Nothing but the laboratory's commands imports this package.
"""

from typing import TYPE_CHECKING

from motorcade.extras import needs_extra

if TYPE_CHECKING:
    from motorcade.lab.environments import parallel_env as parallel_env
    from motorcade.lab.environments import vector_env as vector_env

__all__ = ["parallel_env", "vector_env"]


def __getattr__(name: str) -> object:
    if name not in __all__:
        raise AttributeError(f"module 'motorcade.lab' has no attribute '{name}'")
    with needs_extra("lab", "lab"):
        from motorcade.lab import environments
    return getattr(environments, name)
