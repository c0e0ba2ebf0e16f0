"""What is asked of the tables of a policy: digits, value lost at most, outputs."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Self

from sdpgrind.base import checks
from sdpgrind.base.progress import Progress, silent

PRECISIONS = ("double", "float32", "int16")


@dataclass(frozen=True)
class TablesAsked:
    """What is asked of the tables of a policy; a thing that has tables takes it as `__export_tables__`.

    Attributes
    ----------
    precision : str
        How numbers are kept: "double", "float32" or "int16".
    lost_max : float or None
        Largest value lost by rounding, $ or what the plan charges in; None: any.
    outputs : tuple of str or None
        Names of outputs; None: those of the thing.
    tell : callable(share, text)
        Progress of what is computed for the tables, as of the value lost, $.
    """

    precision: str = "double"
    lost_max: float | None = None
    outputs: tuple[str, ...] | None = None
    tell: Progress = field(default_factory=lambda: silent, compare=False, repr=False)

    @classmethod
    def of(cls, precision: str, lost_max: float | None, outputs: Sequence[str] | None) -> Self:
        """Check `precision`, `lost_max` ($ or what the plan charges in), `outputs`, as `export` has them."""
        checks.one_of("precision", precision, PRECISIONS)
        if lost_max is not None:
            lost_max = checks.nonnegative("lost_max", lost_max, "$, or what the plan charges in")
        if isinstance(outputs, str):
            raise checks.refuse("outputs", "a sequence of names", outputs)
        return cls(precision, lost_max, None if outputs is None else checks.unique("outputs", outputs))

    @property
    def given(self) -> dict[str, Any]:
        """What was asked beyond the tables as they are: names of arguments, and numbers ($)."""
        asked = {"precision": self.precision, "lost_max": self.lost_max, "outputs": self.outputs}
        return {name: one for name, one in asked.items() if one not in (None, "double")}

    def told(self, fixed: Sequence[str], free: Sequence[str], usual: Sequence[str]) -> tuple[str, ...]:
        """Return which outputs stand beside those that are `fixed`.

        Parameters
        ----------
        fixed, free, usual : sequence of str
            Outputs that must be asked for, those that may be (gap, value, $), and of these the ones that are
            told where nothing was asked.

        Raises
        ------
        ValueError
            When other outputs, in whatever unit, were asked for, or not all of the fixed.
        """
        if self.outputs is None:
            return tuple(usual)
        if set(self.outputs) - {*fixed, *free} or set(fixed) - set(self.outputs):
            rule = f"{', '.join(fixed)}, and of {', '.join(free)} those that are wanted"
            raise checks.refuse("outputs", rule, list(self.outputs))
        return tuple(name for name in free if name in self.outputs)
