"""Fastest of `push`."""
