"""Estimation from data: fits, recursive least squares, Kalman filter, moments, densities."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
