"""Distribution of one reading from that of the ratio of a run of n readings.

Readings are log-normal within a run, with variance w^2 of their logarithms. Their mean square is taken as
log-normal with its mean and variance: its logarithm has the variance v = ln(1 + (exp(4 w^2) - 1)/n), and half
the mean of that logarithm exceeds the logarithm of the median by w^2 - v/4. The variance of the logarithm of
a single reading exceeds that of the ratio by the same w^2 - v/4.
"""

import numpy as np

from sdpgrind import sdp
from sdpgrind.finishing.study._observations import Observations, present
from sdpgrind.finishing.study._ratios import RATIOS, back

DB = 20 / np.log(10)  # derived: dB of a change of ln(response) by 1


def law_of_a_reading(study: Observations, mean: float, sd: float) -> sdp.Law:
    """Distribution of one reading for mean and sd (dB) of a run's ratio; of the ratio without inverse."""
    level = back(study.ratio, mean, study.reference)
    if level is None:
        return sdp.Normal(mean, sd)
    lacking = _lacking(study)
    median = level * float(np.exp(-RATIOS[study.ratio].referred * lacking))
    square = (sd / DB) ** 2 + lacking
    whole = median * float(np.exp(0.5 * square))
    return sdp.LogNormal(whole, whole * float(np.sqrt(np.expm1(square))))


def _lacking(study: Observations) -> float:
    """Excess variance w^2 - v/4 of one reading; 0 with one reading a run."""
    variance, n = _within(study), study.readings.shape[1]
    return variance - 0.25 * float(np.log1p(np.expm1(4 * variance) / n))


def _within(study: Observations) -> float:
    """Variance w^2 within runs; from the relative scatter where a reading is 0; 0 with one reading a run."""
    readings = study.readings[present(study)]
    if readings.shape[1] == 1:
        return 0.0
    if np.all(readings > 0):
        return float(np.mean(np.var(np.log(readings), axis=1, ddof=1)))
    whole = readings.mean(axis=1)
    return float(np.log1p(np.mean(np.var(readings / whole[:, None], axis=1, ddof=1))))
