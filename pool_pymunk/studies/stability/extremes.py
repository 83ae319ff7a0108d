"""This module has the table of the extremes: small scenes, each row from mild to extreme."""

from pool_pymunk.studies.stability import known, many, rolling, rounds, straight
from pool_pymunk.studies.stability.trial import Extreme

EXTREMES: list[Extreme] = [*straight.ROWS, *rolling.ROWS, *rounds.ROWS, *known.ROWS, *many.ROWS]
