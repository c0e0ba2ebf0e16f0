"""The best point of a process whose limit drifts with a state that nobody can measure (Koren 1989)."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__, ("processes", "gains"))
