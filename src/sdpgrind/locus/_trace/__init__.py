"""Trace of `locus`."""
