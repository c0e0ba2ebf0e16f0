"""Width of the intervals of the scatter of K1 and K2 beyond that of normal readings, from simulated logs.

The linearised likelihood takes ln Q for normal, which it is not where K2 is a large part of the power: with
passes of 25 to 50 N the variance of the estimate between passes is a fifth above what the likelihood tells.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.weldbead._identify.components import CONFIDENCE, BeadReadings, Reml
from sdpgrind.weldbead.sequence._belief_update import MOST_IDLE

_SAMPLES = 2000  # measured: on 12 logs within 12 % of the factors of 16000 samples, a width within 6 %
_SEED = 0  # chosen: any; the same log gives the same interval


def widening(reml: Reml, beads: Sequence[Mapping[str, Floats]], readings: Sequence[BeadReadings]) -> Floats:
    """Return the factor on the quantile of chi-square for each variance of `reml`, >= 1.

    Of logs at the estimate, with the powers of the log, the efficient score of each variance (free of what
    the others explain) is drawn twice from the same normal numbers: by the law of a pass, and by its
    linearisation, for which chi-square holds. The factor is the ratio of the quantiles of its square.
    """
    if readings[0].loads.shape[1] == 1:  # no idle power: ln Q is normal
        return np.ones(reml.best[0].size)
    rng = np.random.default_rng(_SEED)
    pairs = [_drawn(reml, bead, reading, rng) for bead, reading in zip(beads, readings, strict=True)]
    law, linear = (reml.squares(samples) for samples in zip(*pairs, strict=True))
    mean, efficient = linear.mean(axis=0), np.linalg.inv(np.atleast_2d(np.cov(linear.T)))
    high = [
        np.quantile(np.abs((forms - mean) @ efficient), CONFIDENCE, axis=0) ** 2 for forms in (law, linear)
    ]
    return np.asarray(np.maximum(high[0] / high[1], 1.0))


def _drawn(
    reml: Reml, bead: Mapping[str, Floats], reading: BeadReadings, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """Readings of a bead by the law of a pass, and by its linearisation, each (samples, n)."""
    own, between = reml.spread
    size = reading.y.size
    deviations = between * rng.standard_normal((_SAMPLES, 1, 2))
    deviations = deviations + own * rng.standard_normal((_SAMPLES, size, 2))
    noise = np.sqrt(reading.noise) * rng.standard_normal((_SAMPLES, size))
    energy, idle = np.moveaxis(reml.means + deviations - 0.5 * own**2, -1, 0)  # ln K1, ln K2
    power = bead["grinding_power"]
    left = power - np.minimum(np.exp(idle), power * MOST_IDLE / (1 + MOST_IDLE))
    linearised = reading.y - np.log(bead["removal_rate"])  # what a reading has beside ln Q
    linear = reading.fixed @ reml.means + np.sum(reading.loads * deviations, axis=-1)
    return np.log(left) - energy + linearised + noise, linear + noise
