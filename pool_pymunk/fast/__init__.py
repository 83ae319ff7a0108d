"""This package has what numba compiles: derivatives of many shots, and live tables."""
