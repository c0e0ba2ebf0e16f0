"""Identify of `plunge`."""
