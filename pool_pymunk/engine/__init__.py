"""The contact engine answers contacts in their order, each at its own time.

:mod:`~pool_pymunk.engine.contacts` moves the balls and lets happen what is due;
:mod:`~pool_pymunk.engine.resolver` answers contacts by the law, and
:mod:`~pool_pymunk.engine.policies` those that have no exact answer. Balls that stay in contact move
in :mod:`~pool_pymunk.engine.groups`.
"""
