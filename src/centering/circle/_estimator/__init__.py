"""Estimator of `circle`."""
