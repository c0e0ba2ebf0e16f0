"""Prediction at chosen levels: the mean, and its intervals for the mean and for confirmation runs."""

import dataclasses
from collections.abc import Mapping

import numpy as np

from sdpgrind.base import checks
from sdpgrind.finishing.study._means import spread, student
from sdpgrind.finishing.study._observations import Observations, analysed
from sdpgrind.finishing.study._ratios import RATIOS, back
from sdpgrind.finishing.study._settings import Level, position
from sdpgrind.finishing.study._texts import NOT_AVAILABLE, amount, level, number

Interval = tuple[float, float]


@dataclasses.dataclass(frozen=True, repr=False)
class Prediction:
    """Predicted mean at chosen levels.

    Attributes
    ----------
    levels : mapping of str to level
        Level of each kept factor, in its own unit.
    mean : float
        Mean ratio, dB.
    n_eff : float
        Number of runs whose plain mean is as precise, unit 1.
    ci_mean, ci_confirm : float or None
        Half widths of the intervals of the mean and of that of `confirm` further runs, dB. None: no error.
    confirm, error_df : int
        Number of confirmation runs, and degrees of freedom of the error.
    confidence : float
        Probability of the intervals, unit 1.
    response : float or None
        Mean in the unit of the response. None: the ratio has no inverse.
    response_mean, response_confirm : (float, float) or None
        The two intervals in the unit of the response, low end first.
    unit, ratio_unit : str
        Units of the response and of the ratio.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> study = fin.Study.published("wang-2001")
    >>> study.predict({"tool_diameter": 4.0, "pattern": "hilbert5", "normal_force": 1.111}, confirm=1)
    tool_diameter 4, pattern hilbert5, normal_force 1.111
    mean 8.951 dB (3.568 µm), as good as the mean of 3 runs
    95 % interval of the mean +- 0.736 dB (3.278 µm to 3.884 µm)
    95 % interval of the mean of 1 confirmation run +- 1.472 dB (3.012 µm to 4.227 µm)
    """

    levels: dict[str, Level]
    mean: float
    n_eff: float
    ci_mean: float | None
    ci_confirm: float | None
    confirm: int
    error_df: int
    confidence: float
    response: float | None
    response_mean: Interval | None
    response_confirm: Interval | None
    unit: str
    ratio_unit: str = "dB"

    def __repr__(self) -> str:
        runs = "1 confirmation run" if self.confirm == 1 else f"{self.confirm} confirmation runs"
        shown = (
            "" if self.response is None or self.ratio_unit == "" else f" ({amount(self.response, self.unit)})"
        )
        where = ", ".join(f"{name} {level(value)}" for name, value in self.levels.items()) or "no factor kept"
        return "\n".join(
            [
                where,
                f"mean {self.mean:.3f} {self.ratio_unit or self.unit}".rstrip()
                + f"{shown}, as good as the mean of {self.n_eff:.3g} runs",
                f"{self._share} interval of the mean {self._interval(self.ci_mean, self.response_mean)}",
                f"{self._share} interval of the mean of {runs}"
                f" {self._interval(self.ci_confirm, self.response_confirm)}",
            ]
        )

    @property
    def _share(self) -> str:
        return f"{100 * self.confidence:.3g} %"

    def _interval(self, width: float | None, ends: Interval | None) -> str:
        if width is None:
            return NOT_AVAILABLE
        text = f"+- {number(width, '.3f')} {self.ratio_unit or self.unit}".rstrip()
        return (
            text if ends is None else f"{text} ({amount(ends[0], self.unit)} to {amount(ends[1], self.unit)})"
        )


def predict(study: Observations, levels: Mapping[str, Level], confirm: int, confidence: float) -> Prediction:
    """Prediction of a study; see `Study.predict`."""
    if not isinstance(levels, Mapping):
        raise TypeError(
            "levels must be a mapping from factors to levels, as study.best() gives;"
            f" got {checks.shown(levels)}"
        )
    confirm = checks.count("confirm", confirm)
    names = list(study.factors)
    at = {name: position(study.factors, name, value) for name, value in levels.items()}
    y, model, *_ = analysed(study)
    kept = model.kept([term for term in model.terms if all(names[k] in at for k in term)])
    row = kept.rows(np.array([[at.get(name, 0) for name in names]]))
    mean, share = float((row @ kept.effects(y))[0]), float(spread(kept, row)[0])
    reach = student(kept, y, confidence)
    ci_mean = None if reach is None else reach * float(np.sqrt(share))
    ci_confirm = None if reach is None else reach * float(np.sqrt(share + 1 / confirm))
    return Prediction(
        {name: study.levels(name)[k] for name, k in at.items()},
        mean, 1 / share, ci_mean, ci_confirm, confirm, kept.error_df, confidence,
        back(study.ratio, mean, study.reference), _ends(study, mean, ci_mean), _ends(study, mean, ci_confirm),
        study.unit, RATIOS[study.ratio].unit,
    )  # fmt: skip


def _ends(study: Observations, mean: float, width: float | None) -> Interval | None:
    """Ends of an interval of the ratio (dB) in the unit of the response, low end first."""
    if width is None:
        return None
    one, other = (back(study.ratio, mean + side * width, study.reference) for side in (-1, 1))
    return None if one is None or other is None else (min(one, other), max(one, other))
