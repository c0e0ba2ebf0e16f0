"""Pushes that move a ring: contact, motions of the tip, plans, minimum time (Mears 2006, chapters 5, 6)."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
