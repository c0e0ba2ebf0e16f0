"""Power of a study: results of many simulated repetitions, analysed at once."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.special import fdtri

from sdpgrind.base import checks
from sdpgrind.base.budget import afford
from sdpgrind.base.checks import Floats
from sdpgrind.base.rng import Seed, generator
from sdpgrind.finishing.study._analysed import Analysed
from sdpgrind.finishing.study._anova import anova, error_variance
from sdpgrind.finishing.study._means import mean_rows
from sdpgrind.finishing.study._observations import Observations, analysed, present
from sdpgrind.finishing.study._pooling import Pool
from sdpgrind.finishing.study._ratios import sn_ratio
from sdpgrind.finishing.study._settings import Level, which
from sdpgrind.finishing.study._texts import level, percent

OFTEN = 0.05  # share; chosen: rarer exchanges of two levels are not printed


@dataclasses.dataclass(frozen=True, repr=False)
class Power:
    """Results of simulated repetitions of a study; shares of the repetitions, unit 1.

    Attributes
    ----------
    runs : int
        Number of repetitions.
    significant : mapping of str to float
        Share with p < alpha for each effect.
    without_effect : tuple of str
        Effects absent from the simulated truth, whose significance is false. Empty with a user's model.
    ranking, ranking_returned : tuple of str, float
        Effects in descending order of the study's own sums of squares, and share with this order.
    levels : mapping of str to tuple
        Levels of each factor, in its own unit.
    wins : mapping of str to array, (levels, levels)
        Share in which the level of the row has a higher mean than that of the column.
    best_returned : mapping of str to float
        Share in which each factor's best level is that of the study.
    alpha : float
        Probability below which an effect is significant.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> found = fin.Study.published("wang-2001").power(rng=0)
    >>> 0.25 < found.beats("normal_force", 1.667, 1.111) < 0.45
    True
    """

    runs: int
    significant: dict[str, float]
    without_effect: tuple[str, ...]
    ranking: tuple[str, ...]
    ranking_returned: float
    levels: dict[str, tuple[Level, ...]]
    wins: dict[str, Floats]
    best_returned: dict[str, float]
    alpha: float

    def beats(self, factor: str, one: Level, other: Level) -> float:
        """Return the share (unit 1) in which level `one` of a `factor` has a higher mean than `other`."""
        levels = self.levels[checks.one_of("factor", factor, self.levels)]
        i, j = (self._position(levels, value) for value in (one, other))
        return float(self.wins[factor][i, j])

    @staticmethod
    def _position(levels: tuple[Level, ...], value: Level) -> int:
        found = which(levels, value)
        if found is None:
            raise checks.refuse("level", f"one of {', '.join(map(str, levels))}", value)
        return found

    def standard_error(self, share: float) -> float:
        """Return the standard error (unit 1) of a `share` (unit 1) of the repetitions."""
        return float(np.sqrt(share * (1 - share) / self.runs))

    def __repr__(self) -> str:
        lines = [f"of {self.runs} simulated repetitions of the study:"]
        for name, share in self.significant.items():
            wrongly = (
                " wrongly: the simulated truth has no such effect" if name in self.without_effect else ""
            )
            lines.append(f"  {name} is significant (p < {self.alpha:g}) in {percent(share)}{wrongly}")
        lines.append(f"  the ranking {' > '.join(self.ranking)} returns in {percent(self.ranking_returned)}")
        return "\n".join([*lines, *self._changes()])

    def _changes(self) -> list[str]:
        """Lines on factors whose best level often changes."""
        found = []
        for name, share in self.best_returned.items():
            if self.significant[name] > 0.5 and share < 1 - OFTEN:
                names = [level(value) for value in self.levels[name]]
                rows = self.wins[name]
                best = int(np.argmax(rows.sum(axis=1)))
                changes = [
                    f"{names[k]} beats {names[best]} in {percent(row[best])}"
                    for k, row in enumerate(rows)
                    if k != best and row[best] > OFTEN
                ] or [f"the best level returns in {percent(share)}"]
                found.append(f"  {name}: {', '.join(changes)}")
        return found


def power(study: Observations, rng: Seed, runs: int, model: Any, pool: Pool, alpha: float) -> Power:
    """Power of a study; see `Study.power`."""
    runs = checks.count("runs", runs)
    checks.probability("alpha", alpha)
    found, random = analysed(study), generator(rng)
    size = 4 * 8.0 * runs * study.readings.size  # readings, effects, residuals and a copy
    afford(f"runs = {runs}", size, "fewer runs tell as much")
    linear = found.model
    if linear.error_df == 0:
        raise ValueError(
            "the study must leave an error to test with;"
            " it is saturated: fewer factors, or pool some for `anova`"
        )
    without: tuple[str, ...] = ()
    if model is None:
        drawn, without = _of_its_own(study, found, random, runs, pool)
    else:
        drawn = _of_a_model(study, random, runs, model)
    squares, rest = linear.squares(drawn), np.sum(linear.residuals(drawn) ** 2, axis=-1)
    df, names = np.array(linear.df), [found.named(term) for term in linear.terms]
    least = np.array([fdtri(n, linear.error_df, 1 - alpha) for n in df])
    seen = np.mean(squares * linear.error_df > least * df * rest[:, None], axis=0)
    order = np.argsort([-row.ss for row in anova(study, None).effects], kind="stable")
    returned = np.all(np.diff(squares[:, order], axis=1) < 0, axis=1)
    wins, kept = _levels(found, drawn)
    return Power(
        runs, dict(zip(names, seen.tolist(), strict=True)), without,
        tuple(names[k] for k in order), float(np.mean(returned)),
        {name: study.levels(name) for name in study.factors}, wins, kept, alpha,
    )  # fmt: skip


def _of_its_own(
    study: Observations, found: Analysed, rng: np.random.Generator, runs: int, pool: Pool
) -> tuple[Floats, tuple[str, ...]]:
    """Ratios (runs, observations) of the study's own model without the pooled effects, and their names."""
    pooling = anova(study, pool).pooling
    without = pooling.names if pooling else ()
    y, kept, *_ = found.without(set(without))
    variance = error_variance(kept, y)
    if variance is None:
        raise ValueError("the study must leave an error to simulate with; nothing is left: give a model")
    noise = rng.standard_normal((runs, y.size))
    return kept.design @ kept.effects(y) + np.sqrt(variance) * noise, without


def _of_a_model(study: Observations, rng: np.random.Generator, runs: int, model: Any) -> Floats:
    """Ratios (runs, observations) of readings drawn by a model."""
    draw: Callable[..., npt.ArrayLike] = getattr(model, "responses", model)
    if not callable(draw):
        raise TypeError(
            "model must be a RoughnessModel or a function of settings, rng= and runs=;"
            f" got {checks.shown(model)}"
        )
    there = present(study)
    settings = {name: values[there] for name, values in study.settings.items()}
    readings = checks.finite_array("readings of the model", draw(settings, rng=rng, runs=runs), study.unit)
    count, repeats = int(np.sum(there)), study.readings.shape[1]
    if readings.shape == (runs, count) and repeats == 1:
        readings = readings[..., None]
    if readings.shape != (runs, count, repeats):
        raise ValueError(
            f"readings of the model must be of shape {(runs, count, repeats)}; got {readings.shape}"
        )
    if study.ratio == "none":
        return readings.reshape(runs, -1)
    return sn_ratio(readings, study.ratio, reference=study.reference)


def _levels(found: Analysed, drawn: Floats) -> tuple[dict[str, Floats], dict[str, float]]:
    """Share in which each level of a factor exceeds each other one, and in which the best one returns."""
    linear = found.model
    effects, own = linear.effects(drawn), linear.effects(found.y)
    wins, kept = {}, {}
    for k, name in enumerate(found.factors):
        rows = mean_rows(linear, k)
        means = effects @ rows.T
        wins[name] = np.mean(means[:, :, None] > means[:, None, :], axis=0)
        kept[name] = float(np.mean(np.argmax(means, axis=1) == int(np.argmax(rows @ own))))
    return wins, kept
