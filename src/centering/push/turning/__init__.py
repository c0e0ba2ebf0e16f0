"""Turning of `push`."""
