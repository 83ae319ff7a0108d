"""The contact engine answers contacts in their order, each at its own time.

:mod:`~pool_pymunk.engine.contacts` moves the balls and lets happen what is due;
:mod:`~pool_pymunk.engine.instants` and :mod:`~pool_pymunk.engine.answers` answer contacts by the
law, and :mod:`~pool_pymunk.engine.policies` has the errors of a run's variants. Balls that stay in
contact move in :mod:`~pool_pymunk.engine.modes`.
"""
