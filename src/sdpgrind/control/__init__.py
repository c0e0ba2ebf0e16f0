"""Sampled control shared by the areas: exact sampling, margins, laws with anti-windup."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
