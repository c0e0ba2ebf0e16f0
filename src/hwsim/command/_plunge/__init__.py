"""Plunge of `command`."""
