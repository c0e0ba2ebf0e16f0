"""Adaptive of `plants`."""
