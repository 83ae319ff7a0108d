"""The contact engine answers contacts in their order, each at its own time.

:mod:`~pool_pymunk.engine.contacts` holds the queue and what happens at one instant.
:mod:`~pool_pymunk.engine.resolver` holds the policies for contacts that have no closed form.
:mod:`~pool_pymunk.engine.decisions` holds what both decide, as pure functions of numbers.
:mod:`~pool_pymunk.engine.near` finds what is near a ball where no pymunk space does.
"""
