"""Top tier of weld-bead grinding: depth and duration of each pass, or the stop; Brown (1988), ch. 3 to 5."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
