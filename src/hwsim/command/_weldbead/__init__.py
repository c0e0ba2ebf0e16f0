"""Weldbead of `command`."""
