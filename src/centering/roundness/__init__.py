"""Roundness of a ring: measured profiles, four reference circles, harmonics, error of the probe's roller."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(
    __name__, __file__, renamed={"Runout": "RollerError", "Spectrum": "Harmonics"}
)
