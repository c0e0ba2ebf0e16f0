"""Robust of `locus`."""
