"""A torture suite for billiards simulators: see docs/beside-others.md."""
