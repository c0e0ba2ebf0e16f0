"""Centering of `plants`."""
