"""This package plays many shots: exact ones, by the core."""

from pool_pymunk.many.batch import Batch
from pool_pymunk.many.simulate import simulate_many

__all__ = ["Batch", "simulate_many"]
