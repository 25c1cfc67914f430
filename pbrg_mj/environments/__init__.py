"""The closed loop as environments for reinforcement learning; needs the extra `learn`.

    from pbrg_mj.environments import parallel_env, TeamEnv, TeamVectorEnv

options          what agents do and see, and for how long
observation      what a robot knows, as one vector
reward           what a step was worth
episode          one world with its closed loop, an action at a time
worlds           the worlds that seeds draw
batch_worlds     worlds of one scenario in one batch of physics
separate_worlds  worlds with a plant each
parallel         PettingZoo: every robot, or every leader, is an agent
team             Gymnasium: one agent has the whole team
vector           Gymnasium: many worlds of one scenario or family

docs/learn.md shows how to use them. Importing this loads neither library before a name that needs it.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from pbrg_mj.errors import InputError

if TYPE_CHECKING:
    from pbrg_mj.environments.options import Options
    from pbrg_mj.environments.parallel import TeamParallelEnv, parallel_env
    from pbrg_mj.environments.reward import Step, distance_reward
    from pbrg_mj.environments.team import TeamEnv
    from pbrg_mj.environments.vector import TeamVectorEnv

__all__ = ["Options", "Step", "TeamEnv", "TeamParallelEnv", "TeamVectorEnv", "distance_reward", "parallel_env"]
_HOMES = {
    "Options": "options",
    "Step": "reward",
    "TeamEnv": "team",
    "TeamParallelEnv": "parallel",
    "TeamVectorEnv": "vector",
    "distance_reward": "reward",
    "parallel_env": "parallel",
}
LIBRARIES = ("gymnasium", "pettingzoo")


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used. Raises InputError where its library is not installed."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    try:
        return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    except ModuleNotFoundError as error:
        if error.name in LIBRARIES:
            raise InputError(f"environments need {error.name}: pip install {error.name}") from error
        raise
