"""``python -m pool_pymunk``."""

from pool_pymunk.cli import main

main()
