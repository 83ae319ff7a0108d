"""This package has environments for learners, by the conventions of Gymnasium.

``import pool_pymunk.env`` registers ``pool_pymunk/Carom-v0`` and ``pool_pymunk/Pot-v0``. It needs
``pip install 'pool-pymunk[env]'``.

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

from pool_pymunk.env.single import BilliardsEnv, CaromEnv, PotEnv
from pool_pymunk.env.vector import BilliardsVectorEnv, CaromVectorEnv, PotVectorEnv

__all__ = [
    "BilliardsEnv",
    "BilliardsVectorEnv",
    "CaromEnv",
    "CaromVectorEnv",
    "PotEnv",
    "PotVectorEnv",
]

MOST_SHOTS = 100  # A series of caroms is cut off after this many shots.

gymnasium.register(
    id="pool_pymunk/Carom-v0",
    entry_point="pool_pymunk.env:CaromEnv",
    vector_entry_point="pool_pymunk.env:CaromVectorEnv",
    max_episode_steps=MOST_SHOTS,
)
gymnasium.register(
    id="pool_pymunk/Pot-v0",
    entry_point="pool_pymunk.env:PotEnv",
    vector_entry_point="pool_pymunk.env:PotVectorEnv",
)
