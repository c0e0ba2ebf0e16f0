"""Plunge of `plants`."""
