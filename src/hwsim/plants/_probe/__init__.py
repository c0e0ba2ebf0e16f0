"""Probe of `plants`."""
