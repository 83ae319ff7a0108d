"""This package has what numba compiles: the steps of live tables."""
