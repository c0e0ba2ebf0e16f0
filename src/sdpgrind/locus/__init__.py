"""The optimal locus: best points of a process with an unmeasured, drifting state (Koren 1989)."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__, ("processes", "gains"))
