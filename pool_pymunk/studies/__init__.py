"""Studies measure what a solver errs and costs, what an input is worth, and where solvers break."""
