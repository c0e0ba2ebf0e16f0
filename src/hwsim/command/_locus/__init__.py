"""Locus of `command`."""
