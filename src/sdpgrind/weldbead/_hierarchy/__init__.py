"""Hierarchy of `weldbead`."""
