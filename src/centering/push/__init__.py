"""Pushes that move a ring: contact, profiles of the tip, plans, the push of least time (Mears 2006, chapters 5 and 6)."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
