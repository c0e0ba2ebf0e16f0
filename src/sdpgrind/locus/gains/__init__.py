"""Gains of the controller that walks along a locus: their design, and their decoupling."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
