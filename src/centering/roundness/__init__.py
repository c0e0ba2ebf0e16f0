"""Roundness of a ring: filters, reference circles, cylinders, intervals, roller and spindle errors."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(
    __name__, __file__, renamed={"Runout": "RollerError", "Spectrum": "Harmonics"}
)
