"""Hidden truth of one pass: coefficients that explain its removed depth."""

from collections.abc import Callable
from typing import NamedTuple

from sdpgrind.weldbead.sequence._process import GrindingProcess
from sdpgrind.weldbead.sequence._scatter import Scatter


class PassCoefficients(NamedTuple):
    """True coefficients of the process in one pass."""

    specific_energy: float  # J/mm^3
    idle_power: float  # W
    friction_ratio: float


class _Pass(NamedTuple):
    """A completed pass."""

    process: GrindingProcess
    normal_force: float
    feed_rate: float

    @property
    def swept(self) -> float:
        """Removal rate for 1 mm of depth, mm^3/s."""
        return self.process.bead_width * self.feed_rate


def blamed(
    scatter: Scatter, process: GrindingProcess, normal_force: float, feed_rate: float, cut: float
) -> PassCoefficients:
    """Coefficients whose static cut, Brown (1988), eqs. (4.4)-(4.8), is `cut` (mm) at this force and feed.

    Where several coefficients scatter, each explains the share of the deviation that it has in the variance.
    """
    done = _Pass(process, normal_force, feed_rate)
    now = PassCoefficients(process.specific_energy, process.idle_power, process.friction_ratio)
    if cut <= 0:
        return now._replace(idle_power=max(process.idle_power, grinding_power(process, now, normal_force)))
    mean, shares = _shares(scatter, done)
    reached = mean
    for source, share in shares:
        reached += share * (cut - mean)
        now = _EXPLAIN[source](done, now, reached)
    return now


def grinding_power(process: GrindingProcess, now: PassCoefficients, normal_force: float) -> float:
    """Power at the contact (W) with the friction of this pass."""
    return float(process.replace(friction_ratio=now.friction_ratio).grinding_power(normal_force))


def _shares(scatter: Scatter, done: _Pass) -> tuple[float, list[tuple[str, float]]]:
    """Mean cut (mm), and share of each coefficient in the variance."""
    mean, sd = scatter.moments(*done)
    names = (scatter.attribution,) if isinstance(scatter.attribution, str) else scatter.attribution
    if not isinstance(scatter.relative_sd, tuple) or float(sd) == 0:
        return float(mean), [(names[-1], 1.0)]
    single = [
        scatter.replace(attribution=n, relative_sd=r) for n, r in zip(names, scatter.relative_sd, strict=True)
    ]
    variances = [float(each.moments(*done)[1]) ** 2 for each in single]
    return float(mean), [
        (name, variance / sum(variances)) for name, variance in zip(names, variances, strict=True)
    ]


def _specific_energy(done: _Pass, now: PassCoefficients, cut: float) -> PassCoefficients:
    power = grinding_power(done.process, now, done.normal_force)
    return now._replace(specific_energy=(power - now.idle_power) / (done.swept * cut))


def _c1(done: _Pass, now: PassCoefficients, cut: float) -> PassCoefficients:
    """C1 = 1/K1 scatters, C2 = -K2/(w K1) is constant, Brown (1988), eq. (4.9a): K1 and K2 vary together."""
    power = grinding_power(done.process, now, done.normal_force)
    idle_volume = now.idle_power / now.specific_energy  # mm^3/s
    energy = power / (done.swept * cut + idle_volume)
    return now._replace(specific_energy=energy, idle_power=energy * idle_volume)


def _idle_power(done: _Pass, now: PassCoefficients, cut: float) -> PassCoefficients:
    power = grinding_power(done.process, now, done.normal_force)
    return now._replace(idle_power=power - now.specific_energy * done.swept * cut)


def _friction_ratio(done: _Pass, now: PassCoefficients, cut: float) -> PassCoefficients:
    """Power depends on mu F alone; beyond the peak power of the drive K1 explains the rest."""
    power = now.specific_energy * done.swept * cut + now.idle_power
    needed = min(float(done.process.force_of_power(power)), done.process.peak_force)
    explained = now._replace(friction_ratio=done.process.friction_ratio * needed / done.normal_force)
    return explained if needed < done.process.peak_force else _specific_energy(done, explained, cut)


_EXPLAIN: dict[str, Callable[[_Pass, PassCoefficients, float], PassCoefficients]] = {
    "C1": _c1,
    "K1": _specific_energy,
    "K2": _idle_power,
    "mu": _friction_ratio,
}
