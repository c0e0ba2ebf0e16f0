"""Sequence of `weldbead`."""
