"""Pass planner: a depth asked for becomes a contour, a height and a force, along a measured bead: Brown (1988), chapter 6."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
