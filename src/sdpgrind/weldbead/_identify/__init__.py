"""Identify of `weldbead`."""
