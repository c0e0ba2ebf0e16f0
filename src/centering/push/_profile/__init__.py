"""Motions of the tip: trapezoids, gentle, tapped and filtered pushes, their times."""
