"""The report's own outputs: the log of its Listing 1, and the collision of its Part 1."""
