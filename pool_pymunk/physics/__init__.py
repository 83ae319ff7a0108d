"""The equations of the report as pure functions: velocities, paths and sides in, numbers out.

Nothing here knows a scene, a solver or pymunk. A reader finds the contact laws in
:mod:`~pool_pymunk.physics.laws`, the contacts of one instant in
:mod:`~pool_pymunk.physics.together`, Eq. 10 and the time of impact in
:mod:`~pool_pymunk.physics.motion`, a ball's path from one contact to the next in
:mod:`~pool_pymunk.physics.path`, and what balls bounce off in :mod:`~pool_pymunk.physics.sides`.
"""
