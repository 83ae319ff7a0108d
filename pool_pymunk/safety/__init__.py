"""This package writes whole files or none, and raises Ctrl-C where it does no harm."""
