"""Tool paths over curved surfaces: zigzag, Hilbert curves, rounded corners, lifts, evenness, scallops."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
