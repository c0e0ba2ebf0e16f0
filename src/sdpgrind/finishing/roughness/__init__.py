"""Roughness after a number of passes: a model fitted to runs, and how well it predicts."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
