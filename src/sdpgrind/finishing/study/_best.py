"""Best level of each factor, and its ties."""

import dataclasses
from collections.abc import Iterator, Mapping
from itertools import product

import numpy as np
from scipy.special import stdtr

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.finishing.study._analysed import Analysed
from sdpgrind.finishing.study._anova import AnovaTable, anova, error_variance
from sdpgrind.finishing.study._linear_model import LinearModel
from sdpgrind.finishing.study._means import spread
from sdpgrind.finishing.study._observations import Observations, analysed
from sdpgrind.finishing.study._pooling import Pool
from sdpgrind.finishing.study._settings import Level
from sdpgrind.finishing.study._texts import level


@dataclasses.dataclass(frozen=True)
class Tie:
    """Level that does not differ significantly from the best one.

    Attributes
    ----------
    factor, level : str, float or str
        Factor and its level, in its own unit.
    behind : float
        Mean of the best level minus its own, dB.
    p : float
        Probability of at least this difference between equal levels, unit 1.
    """

    factor: str
    level: Level
    behind: float
    p: float


@dataclasses.dataclass(frozen=True, repr=False)
class Best(Mapping[str, Level]):
    """Best level of each factor: a mapping, each level in its own unit.

    Attributes
    ----------
    levels : mapping of str to level
        Best level of each kept factor.
    ties : tuple of Tie
        Ties of the factors with an effect.
    arbitrary : tuple of str
        Factors without a significant effect: any level will do.
    judged : bool
        Whether there is an error for the test of ties.
    alpha : float
        Probability above which a level is a tie, unit 1.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> fin.Study.published("wang-2001").best()
    tool_diameter: 4
    pattern: hilbert5
    feed_rate: 12.5 (arbitrary: no effect is told from the scatter)
    normal_force: 1.111 (tie: 1.667, 0.155 dB lower, p = 0.67)
    """

    levels: dict[str, Level]
    ties: tuple[Tie, ...]
    arbitrary: tuple[str, ...]
    judged: bool
    alpha: float

    def __getitem__(self, factor: str) -> Level:
        return self.levels[factor]

    def __iter__(self) -> Iterator[str]:
        return iter(self.levels)

    def __len__(self) -> int:
        return len(self.levels)

    def __repr__(self) -> str:
        lines = [f"{factor}: {level(value)}{self._remark(factor)}" for factor, value in self.levels.items()]
        return "\n".join(
            lines if self.judged else [*lines, "ties are not available: no error is left to judge by"]
        )

    def _remark(self, factor: str) -> str:
        if factor in self.arbitrary:
            return " (arbitrary: no effect is told from the scatter)"
        ties = [
            f"{level(t.level)}, {t.behind:.3f} dB lower, p = {t.p:.2g}"
            for t in self.ties
            if t.factor == factor
        ]
        return f" (tie: {'; '.join(ties)})" if ties else ""


def best(study: Observations, pool: Pool, alpha: float) -> Best:
    """Best levels of a study; see `Study.best`."""
    if study.ratio == "none":
        raise ValueError(
            "ratio must say what is better, such as 'smaller' or 'larger', to find the best; got 'none'"
        )
    checks.probability("alpha", alpha)
    table = anova(study, pool)
    found = analysed(study).without(set(table.pooling.names) if table.pooling else set())
    y, model, names, _ = found
    factors = sorted({factor for term in model.terms for factor in term})
    codes = best_codes(model, y)
    levels = {names[k]: study.levels(names[k])[codes[k]] for k in factors}
    arbitrary = tuple(names[k] for k in factors if _without_effect(found, table, k, alpha))
    variance = error_variance(model, y)
    ties = () if variance is None else _ties(study, found, codes, variance, alpha)
    ties = tuple(tie for tie in ties if tie.factor not in arbitrary)
    return Best(levels, ties, arbitrary, variance is not None, alpha)


def _without_effect(found: Analysed, table: AnovaTable, factor: int, alpha: float) -> bool:
    each = [table[found.named(term)].p for term in found.model.terms if factor in term]
    return all(p is not None and p > alpha for p in each)


def best_codes(model: LinearModel, y: Floats) -> list[int]:
    """Levels with the highest mean, the first of equal ones; interacting factors are searched together."""
    effects, codes = model.effects(y), [0] * len(model.counts)
    for group in _groups(model):
        tried = np.array(list(product(*(range(model.counts[k]) for k in group))))
        settings = np.tile(codes, (len(tried), 1))
        settings[:, group] = tried
        means = model.rows(settings) @ effects
        near = means >= means.max() - 1e-9 * (1e-300 + np.ptp(means))
        for k, code in zip(group, tried[int(np.argmax(near))], strict=True):
            codes[k] = int(code)
    return codes


def _groups(model: LinearModel) -> list[list[int]]:
    """Factors of the model in groups that interact, directly or through others."""
    groups: list[set[int]] = []
    for term in model.terms:
        touched = [group for group in groups if group & set(term)]
        groups = [group for group in groups if group not in touched] + [set(term).union(*touched)]
    return [sorted(group) for group in groups]


def _ties(
    study: Observations, found: Analysed, codes: list[int], variance: float, alpha: float
) -> tuple[Tie, ...]:
    """Levels that differ insignificantly from the best, the other factors at their best."""
    model, ties = found.model, []
    effects = model.effects(found.y)
    for k in sorted({factor for term in model.terms for factor in term}):
        name = found.factors[k]
        for other in range(model.counts[k]):
            swapped = [*codes[:k], other, *codes[k + 1 :]]
            change = model.rows(np.array([codes])) - model.rows(np.array([swapped]))
            behind, width = float((change @ effects)[0]), float(np.sqrt(variance * spread(model, change)[0]))
            p = 1.0 if other == codes[k] else float(2 * stdtr(model.error_df, -abs(behind) / width))
            if other != codes[k] and p > alpha:
                ties.append(Tie(name, study.levels(name)[other], behind, p))
    return tuple(ties)
