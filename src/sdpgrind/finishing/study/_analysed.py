"""What is analysed of a study: its ratios (or readings), and the linear model of them."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.study._linear_model import LinearModel, Term
from sdpgrind.finishing.study._ratios import RATIOS, sn_ratio
from sdpgrind.finishing.study._settings import codes_of

if TYPE_CHECKING:
    from sdpgrind.finishing.study._observations import Observations


class Analysed(NamedTuple):
    """Observations y (n,), in dB or with ratio "none" in the unit of the response, and the model of their effects."""

    y: Floats
    model: LinearModel
    factors: tuple[str, ...]
    unit: str

    def named(self, term: Term) -> str:
        """The name of a term."""
        return " x ".join(self.factors[k] for k in term)

    def without(self, names: set[str]) -> "Analysed":
        """The same with the terms of these names left out."""
        kept = [term for term in self.model.terms if self.named(term) not in names]
        return self._replace(model=self.model.kept(kept))


def present(study: "Observations") -> npt.NDArray[np.bool_]:
    """Whether each run has readings, (runs,)."""
    return ~np.isnan(study.readings[:, 0])


def analysed(study: "Observations") -> Analysed:
    """What is analysed: the ratio of each run that is there; with ratio "none" each reading."""
    there, readings, names = present(study), study.readings, list(study.factors)
    single = study.ratio == "none"
    y = readings[there].ravel() if single else sn_ratio(readings[there], study.ratio, reference=study.reference)
    codes = codes_of(study.array, study.columns, study.factors)[there]
    codes = np.repeat(codes, readings.shape[1] if single else 1, axis=0)
    counts = tuple(len(study.levels(name)) for name in names)
    pairs: list[Term] = [(names.index(a), names.index(b)) for a, b in study.interactions]
    return Analysed(
        y,
        LinearModel(codes, counts, (*((k,) for k in range(len(names))), *pairs)),
        tuple(names),
        RATIOS[study.ratio].unit or study.unit,
    )
