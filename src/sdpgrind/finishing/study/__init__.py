"""Designed experiments: orthogonal arrays, signal-to-noise ratios, analysis of variance, the next runs."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
