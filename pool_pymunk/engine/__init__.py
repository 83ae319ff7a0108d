"""The contact engine: contacts in their order, for every solver that finds them at their time.

:mod:`~pool_pymunk.engine.contacts` has the queue and what happens at one instant,
:mod:`~pool_pymunk.engine.resolver` the policies for contacts that have no closed form,
:mod:`~pool_pymunk.engine.decisions` what both decide, as pure functions of numbers, and
:mod:`~pool_pymunk.engine.near` what is near a ball where no pymunk space finds it.
"""
