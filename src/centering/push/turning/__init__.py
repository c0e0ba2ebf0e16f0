"""Pushes while the table turns: lead, limits of speed, sliding rings, motion in the table's frame."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
