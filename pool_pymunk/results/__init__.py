"""A solver keeps a trace, from which a run is made."""
