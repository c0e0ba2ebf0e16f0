"""Whole centering cycle: strategy, controller, and the source's own controller for comparison."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
