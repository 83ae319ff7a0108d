"""This package has walls and their sides, which say when a path meets them."""
