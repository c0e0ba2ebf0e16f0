"""Distributions of what a move does: moments and partial moments in closed form."""
