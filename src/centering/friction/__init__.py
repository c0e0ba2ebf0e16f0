"""Friction between ring and table: laws, motion under a load, estimates from pushes."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
