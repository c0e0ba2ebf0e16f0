"""Adaptations of plunge cycles between parts: state carried over, burn threshold, margins, bounds."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
