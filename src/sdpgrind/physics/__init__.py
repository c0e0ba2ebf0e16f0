"""Grinding physics: pure functions, each law once."""
