"""Where the work lies in the base of a robot: search of a placement, and proofs that there is none."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
