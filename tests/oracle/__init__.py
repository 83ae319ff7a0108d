"""Independent references, which share no code with the engine: answers are compared with them."""
