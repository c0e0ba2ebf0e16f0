"""Designed experiment: settings, readings and their analysis."""

import dataclasses
import os
from collections.abc import Callable, Mapping
from typing import Any

import numpy.typing as npt

from sdpgrind.base import pictures
from sdpgrind.base.rng import Seed
from sdpgrind.finishing.study._anova import AnovaTable, anova
from sdpgrind.finishing.study._best import Best, best
from sdpgrind.finishing.study._means import LevelMeans, level_means
from sdpgrind.finishing.study._next_runs import NextRuns, next_runs
from sdpgrind.finishing.study._observations import Observations
from sdpgrind.finishing.study._pooling import Pool
from sdpgrind.finishing.study._power import Power, power
from sdpgrind.finishing.study._prediction import Prediction, predict
from sdpgrind.finishing.study._report import report
from sdpgrind.finishing.study._settings import FreeRuns, Level
from sdpgrind.finishing.study._sheet import sheet


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Study(Observations):
    """Designed experiment and its readings.

    Parameters
    ----------
    array : OrthogonalArray, str or array_like of whole numbers (runs, columns)
        Level of each column in each run, from 0, or a name for `orthogonal_array`. For other runs:
        `Study.of_runs`.
    factors : mapping of str to sequence
        Levels of each factor (numbers in their own units, or names), in the order of the column's levels. A
        repeated level is a dummy level.
    response : array_like, shape (runs,) or (runs, replicates)
        Readings, in `unit`. NaN in all readings of a run: the run is missing.
    ratio : {"smaller", "larger", "nominal", "nominal_taguchi", "none"}
        Analysed signal-to-noise ratio (dB, see `sn_ratio`); "none": the readings.
    reference : float
        Response of 0 dB, in `unit`.
    columns : sequence of int, optional
        Column of each factor, from 1. Default: the first that fit, if possible without an interaction of two
        factors that hides a third.
    interactions : sequence of (str, str)
        Interactions of two factors in the model.
    name, unit : str
        Name and unit of the response.
    units : mapping of str to str
        Unit of each factor that has one.

    Raises
    ------
    ValueError
        The array is not orthogonal, a factor does not fit its column, a reading is impossible for the ratio,
        or effects are inseparable.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> factors = {"speed": (10.0, 20.0), "grit": ("coarse", "fine")}
    >>> study = fin.Study("L4", factors, [8.0, 4.0, 7.0, 3.0], unit="mm")
    >>> study.sn_ratio.round(2).tolist()  # dB
    [-18.06, -12.04, -16.9, -9.54]
    >>> dict(study.best())
    {'speed': 20.0, 'grit': 'fine'}
    """

    def anova(self, pool: Pool = None) -> AnovaTable:
        """Return the analysis of variance of the ratio.

        Wang and Jan (2001), Table 3, have no degrees of freedom for the error and 7 in total, those of their
        factors; 18 readings have 17, which leaves 10 for the error. Their pure sums of squares repeat the
        plain ones; here they are SS' = SS - df V_e, with the variance V_e of the error. The feed rate, which
        they keep, is not significant (F = 0.62, p = 0.56): pool it.

        Parameters
        ----------
        pool : None, "F<1" or sequence of str
            Effects counted as error: none; all with F below 1 in the table without pooling, once; or these.

        Returns
        -------
        AnovaTable
            Sums of squares in dB^2 (with ratio "none" in the squared unit); after pooling with the table
            before it.

        Raises
        ------
        ValueError
            A pooled effect is unknown, or "F<1" is given and no error is left.

        Examples
        --------
        >>> from sdpgrind import finishing as fin
        >>> row = fin.Study.published("wang-2001").anova()["pattern"]
        >>> round(row.ss, 5), row.df, round(row.F, 3)
        (52.5495, 2, 71.87)
        """
        return anova(self, pool)

    def level_means(self, confidence: float = 0.95) -> LevelMeans:
        """Return the mean ratio (dB) at each level of each factor, with its interval.

        Parameters
        ----------
        confidence : float
            Probability that an interval holds the true mean, unit 1.

        Examples
        --------
        >>> from sdpgrind import finishing as fin
        >>> means = fin.Study.published("wang-2001").level_means()
        >>> {level: round(mean, 3) for level, mean in means["normal_force"].items()}
        {0.556: 2.574, 1.111: 5.541, 1.667: 5.386}
        """
        return level_means(self, confidence)

    def best(self, pool: Pool = None, alpha: float = 0.05) -> Best:
        """Return the level of each factor with the highest ratio, and its ties.

        Wang and Jan (2001) name A1 B1 C1 D3, with 1.667 N. By their readings 1.111 N (D2) is better by 0.155
        dB, but not significantly (p = 0.67); the feed rate (C) is arbitrary.

        Parameters
        ----------
        pool : None, "F<1" or sequence of str
            As in `anova`; pooled factors are left out.
        alpha : float
            Probability above which a difference is a tie and a factor arbitrary, unit 1.

        Raises
        ------
        ValueError
            The ratio is "none", which has no better direction.

        Examples
        --------
        >>> from sdpgrind import finishing as fin
        >>> found = fin.Study.published("wang-2001").best()
        >>> found["normal_force"], found.arbitrary
        (1.111, ('feed_rate',))
        """
        return best(self, pool, alpha)

    def predict(
        self, levels: Mapping[str, Level], *, confirm: int = 1, confidence: float = 0.95
    ) -> Prediction:
        """Return the mean to be expected at chosen levels, with intervals for it and for confirmation runs.

        Parameters
        ----------
        levels : mapping of str to level
            Level of each kept factor, in its own unit. The other factors are pooled into the error.
        confirm : int
            Number of confirmation runs, a whole number.
        confidence : float
            Probability of the intervals, unit 1.

        Returns
        -------
        Prediction
            In dB, and in the unit of the response.

        Raises
        ------
        ValueError
            A factor or a level is unknown.

        Examples
        --------
        >>> from sdpgrind import finishing as fin
        >>> study = fin.Study.published("wang-2001")
        >>> found = study.predict({"tool_diameter": 4.0, "pattern": "hilbert5", "normal_force": 1.111})
        >>> round(found.mean, 3), round(found.ci_mean, 3), round(found.ci_confirm, 3)  # dB
        (8.951, 0.736, 1.472)
        """
        return predict(self, levels, confirm, confidence)

    def power(
        self,
        *,
        rng: Seed = 0,
        runs: int = 2000,
        model: Callable[..., npt.ArrayLike] | Any = None,
        pool: Pool = "F<1",
        alpha: float = 0.05,
    ) -> Power:
        """Return the results of simulated repetitions of the whole study.

        Parameters
        ----------
        rng : int, Generator or SeedSequence
            Source of randomness.
        runs : int
            Number of repetitions, a whole number.
        model : RoughnessModel or callable(settings, rng=, runs=) -> array (runs, ...), optional
            Source of the readings (in the study's unit). Default: the study's own linear model without the
            pooled effects, with its own scatter.
        pool : None, "F<1" or sequence of str
            Effects left out of the study's own model, as in `anova`.
        alpha : float
            Probability below which an effect is significant, unit 1.

        Returns
        -------
        Power
            Shares in unit 1.

        Raises
        ------
        ValueError
            No error is left to simulate or to test with.

        Examples
        --------
        >>> from sdpgrind import finishing as fin
        >>> found = fin.Study.published("wang-2001").power(rng=0)
        >>> found.ranking
        ('pattern', 'normal_force', 'tool_diameter', 'feed_rate')
        >>> 0.03 < found.significant["feed_rate"] < 0.08 and found.ranking_returned > 0.8
        True
        """
        return power(self, rng, runs, model, pool, alpha)

    def next_runs(self, number: int = 3, *, pool: Pool = "F<1") -> NextRuns:
        """Return further runs where, by a response surface, the best may lie.

        Parameters
        ----------
        number : int
            Number of runs, a whole number.
        pool : None, "F<1" or sequence of str
            Effects left out of the surface, as in `anova`.

        Returns
        -------
        NextRuns
            Different settings in their own units, each with its purpose and the distribution of one reading.
            Fewer than `number` if no others tie with the best; none if no factor shows an effect.

        Raises
        ------
        ValueError
            The ratio is "none", the study has interactions, or no error is left.

        Examples
        --------
        >>> from sdpgrind import finishing as fin
        >>> runs = fin.Study.published("wang-2001").next_runs(3)
        >>> [round(run.settings["normal_force"], 2) for run in runs]  # N
        [1.21, 1.3, 1.46]
        """
        return next_runs(self, number, pool)

    def report(self, path: str | os.PathLike[str] | None = None, *, rng: Seed = 0) -> str:
        """Return all results as text, or write them with pictures: readings in their unit, ratios in dB.

        Parameters
        ----------
        path : str or path, optional
            HTML file in an existing folder, one page that needs nothing else. None: the text is returned.
        rng : int, Generator or SeedSequence
            Source of randomness of the simulated repetitions.

        Returns
        -------
        str
            The text, or the path of the file.

        Raises
        ------
        ImportError
            With a path, without the extra ``report``.

        Examples
        --------
        >>> from sdpgrind import finishing as fin
        >>> print(fin.Study.published("wang-2001").report().splitlines()[0])
        roughness R_a: 18 runs in the L18(2^1 3^7), 1 reading each
        """
        return report(self, rng) if path is None else sheet(self, rng, path)

    def plot(self, confidence: float = 0.95) -> Any:
        """Draw the mean ratio (dB) at the levels of each factor, with intervals of `confidence` (unit 1)."""
        return pictures.drawn("sdpgrind.finishing.study._picture:main_effects", self, confidence)

    def __repr__(self) -> str:
        where = "runs of any kind" if isinstance(self.array, FreeRuns) else f"an {self.array.name}"
        return f"Study({self.name}: {self.runs} runs, {where}; factors {', '.join(self.factors)})"
