"""Gain design by stability, violation, noise and drift; schedules; gains of several constraints."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
