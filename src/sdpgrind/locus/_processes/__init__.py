"""Processes of `locus`."""
