"""Motions of the tip: trapezoids, gentle and filtered profiles, their timing."""
