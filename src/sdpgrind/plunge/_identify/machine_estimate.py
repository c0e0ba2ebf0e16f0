"""Estimate of a machine: its values, how well they fit, and the residuals."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from sdpgrind.base import pictures
from sdpgrind.base.checks import Floats
from sdpgrind.base.stored import stored
from sdpgrind.identify import Estimate

_NONE = np.empty(0)


@stored("plunge.machine_estimate")
@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class MachineEstimate(Estimate):
    """Values of a machine with their covariance, and the goodness of the fit.

    Parameters
    ----------
    names, value, covariance, status, message, units, freedom, noise_sd, noise_correlation
        As of `sdpgrind.identify.Estimate`; values in `units`.
    fit : mapping
        Goodness of the fit by name: of size and power ``<name>_chi_square`` (square of the residuals over the
        declared noise, a degree of freedom; unit 1), ``<name>_autocorrelation`` of neighbouring residuals and
        the probability of as much by chance, ``<name>_autocorrelation_p``; noise ``size_sd`` (mm) and
        ``power_sd`` (relative) that the residuals show.
    time, size_residual, power_residual : array
        Times (s) of the rows of all parts, readings less model there (mm, W; NaN: no reading).

    Raises
    ------
    ValueError
        When the shapes do not agree.
    """

    fit: Mapping[str, float] = dataclasses.field(default_factory=dict, kw_only=True)
    time: Floats = dataclasses.field(default_factory=lambda: _NONE, kw_only=True)
    size_residual: Floats = dataclasses.field(default_factory=lambda: _NONE, kw_only=True)
    power_residual: Floats = dataclasses.field(default_factory=lambda: _NONE, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("time", "size_residual", "power_residual"):
            object.__setattr__(self, name, np.array(getattr(self, name), dtype=float))

    def plot(self) -> Any:
        """Draw the residuals of size (µm) and power (W) over time (s); return the figure."""
        return pictures.drawn("sdpgrind.plunge._identify.machine_picture:plot", self)
