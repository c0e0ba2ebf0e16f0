"""What one reading of a further run should be, from the ratio that a run of several readings should have.

Readings are log-normal within a run, with variance w^2 of their logarithms. Then the mean square of n of them is log-normal too,
as far as mean and variance tell: its logarithm has the variance v = ln(1 + (exp(4 w^2) - 1)/n), and half the mean of that
logarithm lies w^2 - v/4 above the logarithm of the median. The same w^2 - v/4 is the variance that a single reading has besides
that of the ratio.
"""

import numpy as np

from sdpgrind import sdp
from sdpgrind.finishing.study._observations import Observations, present
from sdpgrind.finishing.study._ratios import RATIOS, back

DB = 20 / np.log(10)
"""dB of a change of the logarithm of the response by 1."""


def law_of_a_reading(study: Observations, mean: float, sd: float) -> sdp.Law:
    """Law of one reading where the ratio of a run has this mean and sd, dB; of the ratio where there is no way back."""
    level = back(study.ratio, mean, study.reference)
    if level is None:
        return sdp.Normal(mean, sd)
    lacking = _lacking(study)
    median = level * float(np.exp(-RATIOS[study.ratio].referred * lacking))
    square = (sd / DB) ** 2 + lacking
    whole = median * float(np.exp(0.5 * square))
    return sdp.LogNormal(whole, whole * float(np.sqrt(np.expm1(square))))


def _lacking(study: Observations) -> float:
    """Variance of the logarithm of one reading, less that of half the logarithm of the mean square of a run; 0 of one reading."""
    variance, n = _within(study), study.readings.shape[1]
    return variance - 0.25 * float(np.log1p(np.expm1(4 * variance) / n))


def _within(study: Observations) -> float:
    """Variance of the logarithm of a reading within its run; by the relative scatter where a reading is 0."""
    readings = study.readings[present(study)]
    if readings.shape[1] == 1:
        return 0.0
    if np.all(readings > 0):
        return float(np.mean(np.var(np.log(readings), axis=1, ddof=1)))
    whole = readings.mean(axis=1)
    return float(np.log1p(np.mean(np.var(readings / whole[:, None], axis=1, ddof=1))))
