"""Each simulator has one file here, which runs in its own environment."""
