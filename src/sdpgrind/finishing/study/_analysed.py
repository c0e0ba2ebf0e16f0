"""Analysed values of a study (ratios or readings) and their linear model."""

from typing import NamedTuple

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.study._linear_model import LinearModel, Term


class Analysed(NamedTuple):
    """Observations y (n,), in dB or with ratio "none" in the unit of the response, and their linear model."""

    y: Floats
    model: LinearModel
    factors: tuple[str, ...]
    unit: str

    def named(self, term: Term) -> str:
        """Name of a term."""
        return " x ".join(self.factors[k] for k in term)

    def without(self, names: set[str]) -> "Analysed":
        """Copy without the terms of these names."""
        kept = [term for term in self.model.terms if self.named(term) not in names]
        return self._replace(model=self.model.kept(kept))
