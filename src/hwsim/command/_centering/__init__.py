"""Centering of `command`."""
