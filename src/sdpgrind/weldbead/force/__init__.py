"""The bottom tier of weld-bead grinding: a force loop on a motor-driven table (Brown 1988, chapter 7 and Appendix B)."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
