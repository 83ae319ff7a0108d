"""Whole files or none, and Ctrl-C where it does no harm."""
