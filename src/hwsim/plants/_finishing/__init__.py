"""Finishing of `plants`."""
