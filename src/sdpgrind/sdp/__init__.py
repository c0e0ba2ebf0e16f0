"""Stochastic dynamic programming."""

from sdpgrind.sdp._charges import Charge, Constant, Linear, OneSided, Quadratic
from sdpgrind.sdp._empirical import Empirical, RectifiedNormal
from sdpgrind.sdp._law import Law
from sdpgrind.sdp._laws import Discrete, LogNormal, Normal, Point, Rayleigh

__all__ = [
    "Charge",
    "Constant",
    "Discrete",
    "Empirical",
    "Law",
    "Linear",
    "LogNormal",
    "Normal",
    "OneSided",
    "Point",
    "Quadratic",
    "Rayleigh",
    "RectifiedNormal",
]
