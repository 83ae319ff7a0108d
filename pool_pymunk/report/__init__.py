"""This package writes the report's own outputs: the log of Listing 1, the collision of Part 1."""
