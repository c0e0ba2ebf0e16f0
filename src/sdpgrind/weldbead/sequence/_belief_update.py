"""Kalman filter of a bead's log coefficients: one pass is one reading of the friction and one of the energy.

Logarithms of a pass are those of the bead plus its own scatter, N(-s^2/2, s^2) with s^2 the diagonal of the
passes' covariance. Rows of a measurement have the signs of K1, K2 and mu in it.
"""

from math import exp, log, sqrt
from typing import NamedTuple

from sdpgrind.base.checks import Floats

LINEARISED = 3  # measured: three linearisations settle K2 to 1 % after a light pass, one leaves it 2 % high
STRANGE = 4.0  # chosen: sd of an innovation beyond which a pass counts as strange, 6e-5 of all by chance
# measured: error of a linearised energy, unit 1, that makes no pass strange; 0.012 without scatter
LINEAR = 0.02
MOST_IDLE = 10.0  # greatest idle over removing power at which a pass is linearised; chosen: lets K2 move
Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]


class LogBelief(NamedTuple):
    """Normal belief in ln K1 (J/mm^3), ln K2 (W) and ln mu."""

    mean: Vector
    covariance: Matrix

    @classmethod
    def of(cls, mean: Floats, covariance: Floats) -> "LogBelief":
        a, b, c = mean.tolist()
        (aa, ab, ac), (_, bb, bc), (_, _, cc) = covariance.tolist()
        return cls((a, b, c), ((aa, ab, ac), (ab, bb, bc), (ac, bc, cc)))


class Reading(NamedTuple):
    """Linear reading of the belief: `row` @ logs + noise; `expected` at the mean."""

    row: Vector
    value: float
    expected: float
    variance: float  # of the pass's own scatter and of the gauges


def friction(belief: LogBelief, scatter: Vector, ratio: float, gauges: float) -> Reading:
    """Reading ln(F_t/F_n) = ln mu of a pass; `gauges`: relative variance of the forces."""
    return Reading((0.0, 0.0, 1.0), log(ratio), belief.mean[2] - 0.5 * scatter[2], scatter[2] + gauges)


def energy(
    belief: LogBelief, scatter: Vector, power: float, removal: float, depth: float, gauge: float
) -> Reading:
    """Reading ln Q = ln(Pi - K2) - ln K1 of a pass, linearised anew about what it told; Brown (1988), (4.4a).

    Power in W, removal rate in mm^3/s; `depth`: relative variance of the scanned depth, `gauge`: relative
    standard deviation of the power. The idle over the removing power, g, is how much a pass tells of K2.
    """
    told, mean = log(removal), belief.mean
    g, expected, variance = _linearised(mean, scatter, power, depth, gauge, mean[1])
    for _ in range(LINEARISED - 1):
        at = _settled(belief, g, told - expected, variance)
        g, expected, variance = _linearised(mean, scatter, power, depth, gauge, at)
    return Reading((-1.0, -g, 0.0), told, expected, variance)


def _linearised(
    mean: Vector, scatter: Vector, power: float, depth: float, gauge: float, at: float
) -> tuple[float, float, float]:
    """Idle over removing power, expected ln Q and its variance, linearised at ln K2 = `at`."""
    idle, most = exp(at), power * MOST_IDLE / (1 + MOST_IDLE)
    if idle > most:
        idle = most
    removing = power - idle
    g = idle / removing
    slope = g * (mean[1] - log(idle)) if g else 0.0
    own = 0.5 * (scatter[0] - g * g * scatter[1])  # shift by the pass's own K1 and K2, second order
    of_gauge = (1 + g) * gauge
    variance = scatter[0] + g * g * scatter[1] + depth + of_gauge * of_gauge
    return g, log(removing) - slope - mean[0] + own, variance


def _settled(belief: LogBelief, g: float, off: float, variance: float) -> float:
    """Mean of ln K2 after an energy with row (-1, -g, 0), about which it is linearised anew."""
    p, q, _ = belief.covariance
    toward = -q[0] - g * q[1]
    variance += p[0] + g * p[1] - g * toward
    return belief.mean[1] + toward * off / variance if variance > 0 else belief.mean[1]


def spread(belief: LogBelief, reading: Reading) -> tuple[Vector, float]:
    """Covariance of the logs with a reading, and the variance of the reading."""
    (a, b, c), _, _, own = reading
    _, ((aa, ab, ac), (ba, bb, bc), (ca, cb, cc)) = belief
    x, y, z = aa * a + ab * b + ac * c, ba * a + bb * b + bc * c, ca * a + cb * b + cc * c
    return (x, y, z), a * x + b * y + c * z + own


def taken(belief: LogBelief, reading: Reading) -> tuple[LogBelief, float]:
    """Belief after a reading, and the reading's innovation over its standard deviation.

    A reading beyond `STRANGE` deviations has the weight of Huber: its own variance is inflated. One that is
    expected without any variance changes nothing.
    """
    toward, variance = spread(belief, reading)
    off = reading.value - reading.expected
    if variance <= 0:
        return belief, abs(off) / LINEAR
    strange = abs(off) / sqrt(variance + LINEAR * LINEAR)
    if strange > STRANGE:
        variance += reading.variance * (strange / STRANGE - 1)
    return _moved(belief, toward, off / variance, 1 / variance), strange


def _moved(belief: LogBelief, toward: Vector, off: float, gain: float) -> LogBelief:
    """Belief moved by an innovation over its variance, `off`, and narrowed by the gain, 1/variance."""
    (a, b, c), ((k, m, n), ((aa, ab, ac), (_, bb, bc), (_, _, cc))) = toward, belief
    x, y, z = gain * a, gain * b, gain * c
    aa, bb, cc = aa - x * a, bb - y * b, cc - z * c
    if aa < 0 or bb < 0 or cc < 0:  # by rounding
        aa, bb, cc = max(aa, 0.0), max(bb, 0.0), max(cc, 0.0)
    ab, ac, bc = ab - x * b, ac - x * c, bc - y * c
    mean = k + a * off, m + b * off, n + c * off
    return LogBelief(mean, ((aa, ab, ac), (ab, bb, bc), (ac, bc, cc)))
