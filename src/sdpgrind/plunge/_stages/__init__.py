"""Stages of `plunge`."""
