"""Grinding physics, each law once: power, burning, sliding force of the wheel, speed of the disc."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
