"""Gains of `locus`."""
