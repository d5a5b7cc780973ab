"""A laboratory for those who study swarms: environments for learning, and capsules of sweeps."""

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
