"""Who plays the scenes: one file each, run in an environment of its own."""
