"""This package holds the equations of the report as pure functions of numbers.

Nothing here knows a scene, a solver or pymunk. The contact laws are in
:mod:`~pool_pymunk.physics.laws`, the contacts of one instant in
:mod:`~pool_pymunk.physics.together`, Eq. 10 and the time of impact in
:mod:`~pool_pymunk.physics.motion`, and a ball's path from one contact to the next in
:mod:`~pool_pymunk.physics.path`. The walls that balls bounce off, and their sides, are in
:mod:`~pool_pymunk.physics.sides`.
"""
