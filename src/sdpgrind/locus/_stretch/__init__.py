"""Stretch of `locus`."""
