"""This package answers contacts: one by a law, and those of one instant in rounds."""
