"""``pool-pymunk`` and ``python -m pool_pymunk`` begin here, and run the command line."""

import sys

from pool_pymunk.safety.interrupts import interrupted_code, patient_interrupts


def main() -> None:
    """Import the command line, then run it; Ctrl-C ends the import in one line as it does later."""
    try:
        with patient_interrupts():
            from pool_pymunk import cli
    except KeyboardInterrupt:
        print("error: interrupted", file=sys.stderr)
        sys.exit(interrupted_code())
    cli.main()


if __name__ == "__main__":
    main()
