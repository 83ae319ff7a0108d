"""This package has environments for learners, by the conventions of Gymnasium.

``import pool_pymunk.env`` registers ``pool_pymunk/Carom-v0`` and ``pool_pymunk/Pot-v0`` of
billiards, ``pool_pymunk/Carrom-v0``, the board game, and ``pool_pymunk/Billiards-v0`` for games of
your own. It needs ``pip install 'pool-pymunk[env]'``.

>>> import gymnasium as gym
>>> import pool_pymunk.env
>>> env = gym.make("pool_pymunk/Carom-v0")
>>> observation, info = env.reset(seed=0)
>>> observation.shape, env.action_space.shape
((33,), (2,))
"""

try:
    import gymnasium
except ImportError as error:
    message = "pool_pymunk.env needs Gymnasium: pip install 'pool-pymunk[env]'"
    raise ImportError(message, name="gymnasium") from error

from pool_pymunk.env.environments import BilliardsEnv, BilliardsVectorEnv
from pool_pymunk.env.game import Game, Played, Rehearsal, Tables
from pool_pymunk.env.games import (
    Carom,
    CaromEnv,
    CaromVectorEnv,
    Carrom,
    CarromEnv,
    CarromVectorEnv,
    Pot,
    PotEnv,
    PotVectorEnv,
)
from pool_pymunk.env.layouts import Generators

__all__ = ["BilliardsEnv", "BilliardsVectorEnv", "Carom", "CaromEnv", "CaromVectorEnv", "Carrom",
           "CarromEnv", "CarromVectorEnv", "Game", "Generators", "Played", "Pot", "PotEnv",
           "PotVectorEnv", "Rehearsal", "Tables"]  # fmt: skip

for name, most in (("Carom", 100), ("Carrom", None), ("Pot", None), ("Billiards", None)):
    gymnasium.register(
        id=f"pool_pymunk/{name}-v0",
        entry_point=f"pool_pymunk.env:{name}Env",
        vector_entry_point=f"pool_pymunk.env:{name}VectorEnv",
        max_episode_steps=most,  # A series of caroms is cut off.
    )
