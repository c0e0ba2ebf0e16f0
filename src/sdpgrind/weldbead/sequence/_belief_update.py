"""Kalman filter of a bead's log coefficients: one pass is one reading of the friction and one of the energy.

Logarithms of a pass are those of the bead plus its own scatter, N(-s^2/2, s^2) with s^2 the diagonal of the
passes' covariance. Rows of a measurement have the signs of K1, K2 and mu in it.
"""

from math import exp, inf, log, sqrt
from typing import NamedTuple

from sdpgrind.base.checks import Floats

LINEARISED = 3  # measured: three linearisations settle K2 to 1 % after a light pass, one leaves it 2 % high
STRANGE = 4.0  # chosen: sd of an innovation beyond which a pass counts as strange, 6e-5 of all by chance
LINEAR = (
    0.02  # error of a linearised energy, unit 1, that makes no pass strange; measured: 0.012 without scatter
)
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
    belief: LogBelief, scatter: Vector, power: float, removal: float, depth: float, gauge: float, at: float
) -> Reading:
    """Reading ln Q = ln(Pi - K2) - ln K1 of a pass, linearised at ln K2 = `at`; Brown (1988), (4.4a).

    Power in W, removal rate in mm^3/s; `depth`: relative variance of the scanned depth, `gauge`: relative
    standard deviation of the power. The idle over the removing power, g, is how much a pass tells of K2.
    """
    idle = min(exp(at), power * MOST_IDLE / (1 + MOST_IDLE))
    g = idle / (power - idle)
    at = log(idle) if idle > 0 else -inf
    slope = g * (belief.mean[1] - at) if g else 0.0
    own = 0.5 * (scatter[0] - g * g * scatter[1])  # shift by the pass's own K1 and K2, second order
    of_gauge = (1 + g) * gauge
    variance = scatter[0] + g * g * scatter[1] + depth + of_gauge * of_gauge
    expected = log(power - idle) - slope - belief.mean[0] + own
    return Reading((-1.0, -g, 0.0), log(removal), expected, variance)


def spread(belief: LogBelief, reading: Reading) -> tuple[Vector, float]:
    """Covariance of the logs with a reading, and the variance of the reading."""
    a, b, c = reading.row
    p, q, r = belief.covariance
    toward = (
        p[0] * a + p[1] * b + p[2] * c,
        q[0] * a + q[1] * b + q[2] * c,
        r[0] * a + r[1] * b + r[2] * c,
    )
    return toward, a * toward[0] + b * toward[1] + c * toward[2] + reading.variance


def settled(belief: LogBelief, reading: Reading) -> float:
    """Mean of ln K2 after a reading, about which an energy is linearised anew."""
    toward, variance = spread(belief, reading)
    off = reading.value - reading.expected
    return belief.mean[1] + toward[1] * off / variance if variance > 0 else belief.mean[1]


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
    (a, b, c), m, p = toward, belief.mean, belief.covariance
    mean = (m[0] + a * off, m[1] + b * off, m[2] + c * off)
    x, y, z = gain * a, gain * b, gain * c
    ab, ac, bc = p[0][1] - x * b, p[0][2] - x * c, p[1][2] - y * c
    aa, bb, cc = max(p[0][0] - x * a, 0.0), max(p[1][1] - y * b, 0.0), max(p[2][2] - z * c, 0.0)
    return LogBelief(mean, ((aa, ab, ac), (ab, bb, bc), (ac, bc, cc)))
