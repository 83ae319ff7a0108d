"""This package is a torture suite for simulators: see docs/beside-others.md.

`scenes.py` has the scenes, and what is known of each; a file in `runners/` for each simulator plays
them; `play.py` writes how far off they are into `results/`, and `show.py` makes the tables of that.
"""
