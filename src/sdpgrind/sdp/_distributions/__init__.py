"""Distributions of random amounts: moments and partial moments in closed form."""
