"""Weldbead of `plants`."""
