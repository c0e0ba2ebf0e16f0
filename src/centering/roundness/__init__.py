"""How round a ring is: profiles, four reference circles, spectrum, runout."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
