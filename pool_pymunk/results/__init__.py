"""A solver keeps a trace, and a run is made of it."""
