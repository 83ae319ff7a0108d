"""``python -m pool_pymunk`` runs the command line."""

from pool_pymunk.cli import main

main()
