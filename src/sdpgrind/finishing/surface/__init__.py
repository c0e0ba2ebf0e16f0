"""Surfaces as B-splines, their derivatives, and ready-made ones."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
