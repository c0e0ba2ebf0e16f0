"""Pass planner: contour, height and force along a measured bead for a mean depth; Brown (1988), chapter 6."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
