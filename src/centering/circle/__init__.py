"""Circle of an offset ring: fits, streaming estimators, their uncertainty (Mears 2006, chapters 3 and 4)."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
