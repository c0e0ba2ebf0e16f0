"""Fit of `circle`."""
