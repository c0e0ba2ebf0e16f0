"""A designed experiment: what was varied, what was read, and all that the readings can and cannot tell."""

import dataclasses
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


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Study(Observations):
    """A designed experiment and its readings.

    Parameters
    ----------
    array : OrthogonalArray, str or array_like of whole numbers (runs, columns)
        Which level each column has in each run; a name as `orthogonal_array` takes it, or a table of one's own, levels from 0.
        For runs that are no orthogonal array there is `Study.of_runs`.
    factors : mapping of str to sequence
        The levels of each factor by value (numbers in their own units, or names), in the order of the column's levels. A level
        that comes twice is a dummy level.
    response : array_like, shape (runs,) or (runs, replicates)
        Readings, in `unit`. A run whose readings are all NaN is missing.
    ratio : {"smaller", "larger", "nominal", "nominal_taguchi", "none"}
        What is analysed: a signal-to-noise ratio (dB, see `sn_ratio`), or with "none" the readings as they are.
    reference : float
        What is 0 dB, in `unit`.
    columns : sequence of int, optional
        Column of each factor, from 1; by default the first that fit, so that no interaction of two factors hides a
        third where that can be had.
    interactions : sequence of (str, str)
        Interactions of two factors that the model has besides the main effects.
    name, unit : str
        What is read, and in which unit.
    units : mapping of str to str
        Unit of each factor that has one.

    Raises
    ------
    ValueError
        When the array is not orthogonal, a factor does not fit its column, a reading is impossible for the ratio, or effects
        cannot be told apart.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> study = fin.Study("L4", {"speed": (10.0, 20.0), "grit": ("coarse", "fine")}, [8.0, 4.0, 7.0, 3.0], unit="mm")
    >>> study.sn_ratio.round(2).tolist()  # dB
    [-18.06, -12.04, -16.9, -9.54]
    >>> dict(study.best())
    {'speed': 20.0, 'grit': 'fine'}
    """

    def anova(self, pool: Pool = None) -> AnovaTable:
        """Return the analysis of variance of the ratio.

        Wang and Jan (2001), Table 3, have no degrees of freedom for the error and 7 in sum: those of their factors. Eighteen
        readings have 17, so that 10 are left to judge by. Their pure sums of squares repeat the plain ones; here they are
        SS' = SS - df V_e, with the variance V_e of the error. The feed rate, that they keep, does not stand out of the error
        (F = 0.62, p = 0.56): pool it.

        Parameters
        ----------
        pool : None, "F<1" or sequence of str
            Which effects are counted as error: none; all whose F is below 1 in the table without pooling, once; or these.

        Returns
        -------
        AnovaTable
            Sums of squares in dB^2 (with ratio "none" in the squared unit); after pooling with the table before it.

        Raises
        ------
        ValueError
            When an effect to be pooled is unknown, or "F<1" is asked where no error is left to judge by.

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
        """Return the level of each factor with the highest ratio, and which others the data cannot tell from it.

        Wang and Jan (2001) name A1 B1 C1 D3, with 1.667 N. By their readings 1.111 N (D2) is better, by 0.155 dB, and neither can
        be told from the other (p = 0.67); the feed rate (C) is arbitrary.

        Parameters
        ----------
        pool : None, "F<1" or sequence of str
            As in `anova`; pooled factors are left out.
        alpha : float
            Probability, unit 1, from which on a difference is called a tie, and a factor without effect arbitrary.

        Raises
        ------
        ValueError
            With ratio "none", of which more need not be better.

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
        """Return the mean to be expected at chosen levels, and where runs that confirm it should fall.

        Parameters
        ----------
        levels : mapping of str to level
            The factors that are kept, and the level of each (in its own unit). Factors left out are pooled into the error.
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
            For an unknown factor or level.

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
        """Return what repeating the whole study would find, how often: it is simulated many times.

        Parameters
        ----------
        rng : int, Generator or SeedSequence
            Source of randomness.
        runs : int
            Number of simulated studies, a whole number.
        model : RoughnessModel or callable(settings, rng=, runs=) -> array (runs, ...), optional
            What the readings (in the study's unit) come from; by default the study's own linear model without the pooled effects,
            with its own scatter.
        pool : None, "F<1" or sequence of str
            Which effects the study's own model is without; as in `anova`.
        alpha : float
            Probability, unit 1, below which an effect counts as significant.

        Returns
        -------
        Power
            Shares in unit 1.

        Raises
        ------
        ValueError
            When no error is left to simulate or to test with.

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
        """Return further runs that are worth making: a response surface says where the best may lie between the levels.

        Parameters
        ----------
        number : int
            How many, a whole number.
        pool : None, "F<1" or sequence of str
            Which effects the surface is without; as in `anova`.

        Returns
        -------
        NextRuns
            Settings in their own units, no two alike, with the law of one reading to be expected, and why. Fewer than `number`
            where no others are as good, as far as the data say; none where no factor shows an effect.

        Raises
        ------
        ValueError
            With ratio "none", or when no error is left.

        Examples
        --------
        >>> from sdpgrind import finishing as fin
        >>> runs = fin.Study.published("wang-2001").next_runs(3)
        >>> [round(run.settings["normal_force"], 2) for run in runs]  # N
        [1.21, 1.3, 1.46]
        """
        return next_runs(self, number, pool)

    def report(self, *, rng: Seed = 0) -> str:
        """Return all of this as text: readings in their unit, ratios in dB, and what they cannot tell.

        Parameters
        ----------
        rng : int, Generator or SeedSequence
            Source of randomness for what a repetition would find.

        Examples
        --------
        >>> from sdpgrind import finishing as fin
        >>> print(fin.Study.published("wang-2001").report().splitlines()[0])
        roughness R_a: 18 runs in the L18(2^1 3^7), 1 reading each
        """
        return report(self, rng)

    def plot(self, confidence: float = 0.95) -> Any:
        """Draw the mean ratio (dB) over the levels of each factor, with intervals of `confidence` (probability); the figure."""
        return pictures.drawn("sdpgrind.finishing.study._picture:main_effects", self, confidence)

    def __repr__(self) -> str:
        where = "runs of any kind" if isinstance(self.array, FreeRuns) else f"an {self.array.name}"
        return f"Study({self.name}: {self.runs} runs, {where}; factors {', '.join(self.factors)})"
