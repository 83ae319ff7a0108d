"""This package moves balls: paths, the surfaces and patches that make them, meetings of two."""
