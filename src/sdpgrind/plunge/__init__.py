"""Cylindrical plunge grinding: fastest cycles without burned layers (Dong, Danai and Malkin 2004, Part 2)."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__, ("learning",))
