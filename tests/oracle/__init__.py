"""Independent references, which share no code with the engine: tests compare answers with theirs."""
