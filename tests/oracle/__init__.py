"""Independent references, which share no code with the engine: answers of tests come from them.

``reference`` has single contacts in forty digits, ``hard_reference`` collapse and discs that press
on each other in ninety, and ``press_reference`` the forces of all contacts that persist.
"""
