"""Curve of `locus`."""
