"""Roughness of what was finished: its law, from data and back, and when another pass is worth it."""
