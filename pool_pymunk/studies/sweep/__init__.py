"""This package plays sweeps: any number of shots, into a folder of Parquet files."""

from pool_pymunk.studies.sweep.job import Sweep, sweep
from pool_pymunk.studies.sweep.plan import Plan

__all__ = ["Plan", "Sweep", "sweep"]
