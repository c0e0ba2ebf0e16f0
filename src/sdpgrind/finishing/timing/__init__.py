"""Time laws along a path within limits of joints, and the table that follows them."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
