"""Mean ratio at each level of each factor."""

import dataclasses
from collections.abc import Iterator, Mapping

import numpy as np
from scipy.special import stdtrit

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.finishing.study._anova import error_variance
from sdpgrind.finishing.study._linear_model import LinearModel
from sdpgrind.finishing.study._observations import Observations, analysed
from sdpgrind.finishing.study._ratios import back
from sdpgrind.finishing.study._settings import Level
from sdpgrind.finishing.study._texts import aligned, amount, level, number


@dataclasses.dataclass(frozen=True)
class LevelMean:
    """Mean at one level of a factor.

    Attributes
    ----------
    factor, level : str, float or str
        Factor and its level, in its own unit.
    mean : float
        Mean ratio, dB, with equal weights of the other factors' levels.
    half_width : float or None
        Half width of its interval, dB. None: no error is left.
    response : float or None
        Mean in the unit of the response. None: the ratio has no inverse.
    """

    factor: str
    level: Level
    mean: float
    half_width: float | None
    response: float | None


@dataclasses.dataclass(frozen=True, repr=False)
class LevelMeans(Mapping[str, dict[Level, float]]):
    """Mean ratios (dB) by factor and level, printed as a table.

    Attributes
    ----------
    rows : tuple of LevelMean
        One for each level of each factor, dB.
    unit : str
        Unit of the response.
    """

    rows: tuple[LevelMean, ...]
    unit: str

    def __getitem__(self, factor: str) -> dict[Level, float]:
        """Return the means (dB) of a factor by level."""
        checks.one_of("factor", factor, list(self))
        return {row.level: row.mean for row in self.rows if row.factor == factor}

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys(row.factor for row in self.rows))

    def __len__(self) -> int:
        return len(list(iter(self)))

    def __repr__(self) -> str:
        cells = [
            (
                r.factor,
                level(r.level),
                f"{r.mean:.3f}",
                number(r.half_width, ".3f"),
                number(None) if r.response is None else amount(r.response, self.unit),
            )
            for r in self.rows
        ]
        return aligned(("factor", "level", "mean", "+-", "response"), cells)


def level_means(study: Observations, confidence: float) -> LevelMeans:
    """Means of a study; see `Study.level_means`."""
    (y, model, *_), rows = analysed(study), []
    effects, reach = model.effects(y), student(model, y, confidence)
    for k, factor in enumerate(study.factors):
        at = mean_rows(model, k)
        widths = np.sqrt(spread(model, at))
        for value, mean, width in zip(study.levels(factor), at @ effects, widths, strict=True):
            half = None if reach is None else float(reach * width)
            rows.append(LevelMean(factor, value, float(mean), half, back(study.ratio, mean, study.reference)))
    return LevelMeans(tuple(rows), study.unit)


def mean_rows(model: LinearModel, factor: int) -> Floats:
    """Rows of the design that give the means at a factor's levels, averaged over the other factors."""
    count = model.counts[factor]
    codes = np.zeros((count, len(model.counts)), dtype=np.int64)
    codes[:, factor] = np.arange(count)
    parts = [np.ones((count, 1))]
    for term in model.terms:
        columns = model.columns(codes, term)
        # effects sum to zero over the averaged factors
        parts.append(columns if term == (factor,) else np.zeros_like(columns))
    return np.column_stack(parts)


def spread(model: LinearModel, rows: Floats) -> Floats:
    """Variance of rows times effects, relative to that of the error."""
    return np.asarray(np.einsum("ip,pq,iq->i", rows, model.inverse, rows))


def student(model: LinearModel, y: Floats, confidence: float) -> float | None:
    """Half width of a two-sided interval for a spread of 1, dB; None: no error is left."""
    checks.probability("confidence", confidence)
    variance = error_variance(model, y)
    if variance is None:
        return None
    return float(stdtrit(model.error_df, 0.5 + confidence / 2) * np.sqrt(variance))
