"""The Gaussian filter for closed profiles (ISO 16610-21 with ISO 12181-2)."""

import warnings

import numpy as np
import numpy.typing as npt

from centering.roundness._harmonics import even_harmonics, even_values
from sdpgrind.base.checks import Floats

CUT_OFFS = (15, 50, 150, 500, 1500)
"""Source: ISO 12181-2, usual cut-offs, undulations per revolution."""
PRACTICE = 7  # chosen: samples for each undulation at the cut-off
PASSED = 5  # derived: cut-offs up to which harmonics are kept; beyond, less than 3e-8 passes


def transmission(upr: npt.ArrayLike, cut_off: float) -> Floats:
    """Transmission of the amplitude; one half at the cut-off."""
    return np.asarray(np.exp2(-((np.asarray(upr, dtype=float) / cut_off) ** 2)))


def filter_even(values: Floats, cut_off: float) -> Floats:
    """Low-pass values on an even turn; exact, as the circular convolution is a product of harmonics."""
    coef = even_harmonics(values)
    return even_values(coef * transmission(np.arange(coef.size), cut_off), values.size)


def warn_if_sparse(points: float, cut_off: float) -> None:
    """Warn where a turn has fewer points than good practice requires."""
    if points * (1 + 1e-6) < PRACTICE * cut_off:
        warnings.warn(
            f"{points:.4g} points a turn are {points / cut_off:.2g} for each undulation at the cut-off of"
            f" {cut_off:g} upr; good practice is {PRACTICE}:"
            f" a cut-off of {points / PRACTICE:.3g} upr at most",
            stacklevel=3,
        )
