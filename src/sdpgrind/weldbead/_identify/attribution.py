"""The coefficient that scatters, and the distribution of the depth; Brown (1988), section 8.3, point 4.

Each attribution predicts how the standard deviation of the depth varies with force and feed. Depths of passes
at several forces and feeds are divided by the prediction; the likelihood of normal residuals compares the
attributions.
"""

import dataclasses
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import stdtrit

from sdpgrind import identify as idf
from sdpgrind import sdp
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen
from sdpgrind.weldbead.sequence._process import GrindingProcess
from sdpgrind.weldbead.sequence._scatter import ATTRIBUTIONS, Scatter

SCATTER_METHODS = ("fit", "model", "components")
LAW_METHODS = ("kernel", "sample")
_OF_PASSES = {"normal_force": "N", "feed_rate": "mm/s", "cut_depth": "mm"}
_DECISIVE = 3.0  # chosen: difference of log-likelihood, 20 times as likely
_ABSURD = 12.0  # chosen: standard deviations that no residual of a sound fit reaches
_CHANCE = 1e-3  # chosen: that one of the sound passes of a log is called wrong
_PEERS = 10  # chosen: passes of like depth whose scatter is that of a gauge, too
_MOST_WRONG = 5  # chosen: depths below 0 that are looked at; where more are there, noise makes them


@dataclasses.dataclass(frozen=True, repr=False)
class ScatterEstimate(Frozen):
    """Scatter of the depth under each attribution, and the attributions favoured by the data.

    Parameters
    ----------
    names : tuple of str
        Attributions compared.
    relative_sd : tuple of float
        Relative standard deviation of the coefficient under each, unit 1.
    standard_error : tuple of float
        Standard error of these, unit 1.
    log_likelihood : tuple of float
        Log-likelihood of the standardised residuals under each, unit 1.
    favoured : str
        Likeliest attribution.
    plausible : tuple of str
        Attributions less than 20 times as unlikely, the favoured one first.
    distinguishable : bool
        Whether the plausible ones predict the same scatter (C1 and mu do without droop), so that the choice
        is irrelevant.
    scatter : Scatter
        Favoured attribution with its relative standard deviation, for `SequenceProblem.updated`.
    process : GrindingProcess
        Process of the mean cut, K1 (J/mm^3) and K2 (W) fitted unless the model's were.
    message : str
        Data behind it.

    Examples
    --------
    >>> import numpy as np
    >>> from sdpgrind import weldbead
    >>> process, rng = weldbead.preset("P1").model, np.random.default_rng(0)
    >>> force, feed = np.tile([15.0, 30.0, 50.0], 60), np.repeat([3.0, 12.0], 90)
    >>> depth = weldbead.Scatter("K2", 0.3).cut(process, force, feed).sample(rng)
    >>> data = {"normal_force": force, "feed_rate": feed, "cut_depth": depth}
    >>> weldbead.identify(data, "scatter", model=process).favoured
    'K2'
    """

    names: tuple[str, ...]
    relative_sd: tuple[float, ...]
    standard_error: tuple[float, ...]
    log_likelihood: tuple[float, ...]
    favoured: str
    plausible: tuple[str, ...]
    distinguishable: bool
    scatter: Scatter
    process: GrindingProcess
    message: str

    def __getitem__(self, name: str) -> float:
        """Return the relative standard deviation (unit 1) under the attribution of that name."""
        return self.relative_sd[self.names.index(checks.one_of("name", name, self.names))]

    def __repr__(self) -> str:
        rows = zip(self.names, self.relative_sd, self.standard_error, strict=True)
        shown = ", ".join(f"{name} {value:.4g} ± {error:.2g}" for name, value, error in rows)
        plausible = ", ".join(self.plausible)
        return (
            f"ScatterEstimate({self.favoured} favoured of relative sd {shown}; plausible {plausible};"
            f" {self.message})"
        )


class _LawFit(NamedTuple):
    scatter: Scatter
    process: GrindingProcess
    likelihood: float
    unit: Floats  # standardised residuals
    sd: Floats


def estimate_scatter(
    data: Any, method: str, *, model: GrindingProcess | None, law: str, depth_noise: float
) -> ScatterEstimate:
    """Compare the attributions; see `identify`."""
    read, process = _passes(data, model, method)
    _refuse_wrong_depths(read, process, method == "fit", law, depth_noise)
    fits = {name: _fitted(read, process, name, method == "fit", law, depth_noise) for name in ATTRIBUTIONS}
    order = sorted(fits, key=lambda name: -fits[name].likelihood)
    best = fits[order[0]]
    _refuse_absurd(best, depth_noise)
    plausible = tuple(name for name in order if fits[name].likelihood > best.likelihood - _DECISIVE)
    return ScatterEstimate(
        names=ATTRIBUTIONS,
        relative_sd=tuple(float(fits[name].scatter.total) for name in ATTRIBUTIONS),
        standard_error=tuple(_standard_error(fits[name]) for name in ATTRIBUTIONS),
        log_likelihood=tuple(fits[name].likelihood for name in ATTRIBUTIONS),
        favoured=order[0],
        plausible=plausible,
        distinguishable=all(np.allclose(fits[name].sd, best.sd, rtol=1e-6) for name in plausible),
        scatter=best.scatter,
        process=best.process,
        message=read.message,
    )


def _refuse_absurd(fit: _LawFit, depth_noise: float) -> None:
    """Refuse residuals too large for any distribution: noise of the scans dominates in light passes."""
    worst = float(np.max(np.abs(fit.unit)))
    if worst > _ABSURD:
        raise ValueError(
            "depth_noise must cover what the measured cut_depth is uncertain by (mm): the best fit leaves a"
            f" residual of {worst:.0f} standard deviations; got {depth_noise:g}"
        )


def _refuse_wrong_depths(
    read: idf.Readings, process: GrindingProcess, refit: bool, law: str, noise: float
) -> None:
    """Refuse depths below 0 that the scatter of the others explains under no attribution.

    The least one, two, ... are left out of the fit and held against it (Rosner's test, so that two of them
    do not hide each other); Student's quantile, of the passes of like depth, is shared among all.
    """
    order, wrong = np.argsort(read["cut_depth"], kind="stable"), 0
    for count in range(1, min(int(np.sum(read["cut_depth"] < 0)), _MOST_WRONG, read.points - 4) + 1):
        peers = min(_PEERS, read.points - count)
        usual = float(-stdtrit(peers, _CHANCE / (read.points - count + 1)))
        if _distance(read, order[:count], process, refit, law, noise) > usual:
            wrong = count
    if wrong:
        force, feed, depth = (float(read[name][order[0]]) for name in _OF_PASSES)
        more = f", and {wrong - 1} more like it" if wrong > 1 else ""
        raise ValueError(
            f"cut_depth must be >= 0 within the scatter of the passes and depth_noise (mm); got {depth:.4g}"
            f" in the pass of normal_force {force:.6g} N and feed_rate {feed:.6g} mm/s{more}: a wrong"
            f" reading? Take it out, or say depth_noise= if depths are that uncertain; got {noise:g}"
        )


def _distance(
    read: idf.Readings, out: Any, process: GrindingProcess, refit: bool, law: str, noise: float
) -> float:
    """Standard deviations of the last of the rows `out` below the fit of the others, of the best attribution.

    Those of the attribution, or of the passes of like depth about it, whichever are greater.
    """
    kept, last, found = np.ones(read.points, dtype=bool), out[-1], []
    kept[out] = False
    others = read.only(kept)
    for name in ATTRIBUTIONS:
        fit = _fitted(others, process, name, refit, law, noise)
        mean, sd = _mean_and_sd(read, fit.process, fit.scatter, noise)
        left = (read["cut_depth"] - mean)[kept]
        alike = np.argsort(np.abs(mean[kept] - mean[last]), kind="stable")[:_PEERS]
        spread = max(float(sd[last]), float(np.sqrt(np.mean(left[alike] ** 2))))
        found.append(float(mean[last] - read["cut_depth"][last]) / spread)
    return min(found)


def estimate_law(
    data: Any,
    method: str,
    *,
    model: GrindingProcess | None,
    law: str,
    depth_noise: float,
    attribution: str | None,
    bandwidth: float | None,
) -> Scatter:
    """Empirical distribution of the standardised depths; see `identify`."""
    read, process = _passes(data, model, "fit")
    negative = int(np.sum(read["cut_depth"] < -5 * depth_noise))
    if negative:
        raise ValueError(
            f"cut_depth must be >= 0 up to 5 depth_noise, {5 * depth_noise:g} mm (mm);"
            f" got {negative} of {read.points} that are not"
        )
    if attribution is None:
        attribution = estimate_scatter(data, "fit", model=model, law=law, depth_noise=depth_noise).favoured
    fit = _fitted(
        read, process, checks.one_of("attribution", attribution, ATTRIBUTIONS), True, law, depth_noise
    )
    if bandwidth is None:
        bandwidth = float((0.75 * read.points) ** -0.2) if method == "kernel" else 0.0
    return fit.scatter.replace(law="empirical", sample=tuple(fit.unit.tolist()), bandwidth=bandwidth)


def _passes(data: Any, model: GrindingProcess | None, method: str) -> tuple[idf.Readings, GrindingProcess]:
    """Passes of positive mean cut, and the model."""
    model = checks.kind("model", model, GrindingProcess, ", whose mean cut the depths scatter about")
    # The planner needs the scatter about the command; sensor noise of the force would count as scatter.
    read = idf.readings(data, _OF_PASSES, tier="sequence", each="passes", commanded=("normal_force",))
    if np.any(read["feed_rate"] <= 0):
        raise checks.refuse("feed_rate", "> 0", float(read["feed_rate"].min()), "mm/s")
    read = read.only(read["normal_force"] > 1.02 * model.threshold_force)
    read.require(4 if method == "fit" else 3)
    return (read.levels("normal_force") if method == "fit" else read), model


def _fitted(
    read: idf.Readings, process: GrindingProcess, name: str, refit: bool, law: str, noise: float
) -> _LawFit:
    """Likeliest relative sd under one attribution."""

    def tried(log_r: float) -> _LawFit:
        scatter = Scatter(name, float(np.exp(log_r)), law=law)
        return _evaluated(
            read, _refitted(read, process, scatter, noise) if refit else process, scatter, noise
        )

    bound = float(np.log(0.5 if law == "normal" else 3.0))
    found = minimize_scalar(
        lambda log_r: -tried(log_r).likelihood,
        bounds=(np.log(1e-4), bound),
        method="bounded",
        options={"xatol": 1e-7},
    )
    best = tried(float(found.x))
    # Maximum likelihood divides by n; unbiased is n less the number of fitted coefficients.
    inflated = best.scatter.total * np.sqrt(read.points / (read.points - (2 if refit else 0)))
    return best._replace(scatter=Scatter(name, min(float(inflated), float(np.exp(bound))), law=law))


def _evaluated(read: idf.Readings, process: GrindingProcess, scatter: Scatter, noise: float) -> _LawFit:
    mean, sd = _mean_and_sd(read, process, scatter, noise)
    unit = (read["cut_depth"] - mean) / sd
    likelihood = -float(np.sum(0.5 * unit**2 + np.log(sd) + 0.5 * np.log(2 * np.pi)))
    return _LawFit(scatter, process, likelihood, unit, sd)


def _mean_and_sd(
    read: idf.Readings, process: GrindingProcess, scatter: Scatter, noise: float
) -> tuple[Floats, Floats]:
    mean, sd = scatter.moments(process, read["normal_force"], read["feed_rate"])
    if scatter.law == "rayleigh":
        sd = np.minimum(sd, mean / sdp.Rayleigh.SWITCH)
    floor = 1e-6 * float(np.abs(read["cut_depth"]).max() or 1.0)
    return mean, np.sqrt(sd**2 + noise**2 + floor**2)


def _refitted(
    read: idf.Readings, process: GrindingProcess, scatter: Scatter, noise: float
) -> GrindingProcess:
    """K1 and K2 of the mean cut: three weighted regressions of removal rate on power."""
    power = scatter.expected(process).grinding_power(read["normal_force"])
    whole = process.bead_width * read["feed_rate"]
    rate = whole * read["cut_depth"]
    for _ in range(3):
        weights = 1 / (whole * _mean_and_sd(read, process, scatter, noise)[1]) ** 2
        a, b = _line(power, rate, weights / weights.sum())
        if a > 0 or b <= 0:  # no idle power below 0
            a, b = 0.0, float(np.sum(weights * power * rate) / np.sum(weights * power**2))
        if b <= 0:
            return process
        process = process.replace(specific_energy=1 / b, idle_power=-a / b)
    return process


def _line(x: Floats, y: Floats, share: Floats) -> tuple[float, float]:
    """Value at 0 and slope of the weighted regression of y on x; slope 0 where all x are the same."""
    away = x - share @ x
    alike = np.ptp(x) <= 1e-9 * np.max(np.abs(x))  # where the passes of another force are left out
    slope = 0.0 if alike else float((share * away) @ y / ((share * away) @ away))
    return float(share @ y - slope * (share @ x)), slope


def _standard_error(fit: _LawFit) -> float:
    kurtosis = float(np.mean(fit.unit**4) / np.mean(fit.unit**2) ** 2)
    return float(fit.scatter.total * np.sqrt((kurtosis - 1) / (4 * fit.unit.size)))
