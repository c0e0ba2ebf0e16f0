"""Adaptation between parts: safety margins, bounds of constraints, sharpness."""
