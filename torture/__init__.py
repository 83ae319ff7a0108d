"""This package is a torture suite for simulators: see docs/beside-others.md."""
