"""Surfaces as B-splines, ready-made, from files or fitted to scans; patches with trimming."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
