"""Roundness of a ring: measured profiles, four reference circles, spectrum, runout of the probe's roller."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
