"""Finishing of `command`."""
