"""What is analysed of a study: its ratios (or readings), and the linear model of them."""

from typing import NamedTuple

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.study._linear_model import LinearModel, Term


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
