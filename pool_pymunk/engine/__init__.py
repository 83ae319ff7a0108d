"""The contact engine answers contacts in their order, each at its own time.

:mod:`~pool_pymunk.engine.contacts` moves the balls, and lets happen what is due.
:mod:`~pool_pymunk.engine.due` holds the tagged events that are due, in a queue.
:mod:`~pool_pymunk.engine.instant` holds what meets at one instant.
:mod:`~pool_pymunk.engine.resolver` answers contacts by the law.
:mod:`~pool_pymunk.engine.policies` holds what a run, or a variant of it, makes of hard contacts.
:mod:`~pool_pymunk.engine.decisions` holds decisions, as pure functions of numbers.
:mod:`~pool_pymunk.engine.near` finds what is near a ball where no pymunk space does.
"""
