"""This package plays many shots: exact ones, compiled from the project's own functions."""

from pool_pymunk.fast.batch import Batch
from pool_pymunk.fast.many import simulate_many

__all__ = ["Batch", "simulate_many"]
