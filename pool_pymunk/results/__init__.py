"""What comes out of a solver: the trace that it keeps, and the run that is made of it."""
