"""Correct of `locus`."""
