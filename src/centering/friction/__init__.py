"""Friction between ring and table: laws, drift, estimates from pushes."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
