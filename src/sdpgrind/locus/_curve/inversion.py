"""The optimum for a measured response: inversion for the hidden state, then a table by the state."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.locus._curve import inversion_kernels as kernels
from sdpgrind.locus._curve.inversion_kernels import retrieve
from sdpgrind.locus._trace.table import LocusTable
from sdpgrind.locus._trace.table_kernels import INSIDE, NO_KEY

if TYPE_CHECKING:
    from sdpgrind.codegen import Recipe


@dataclass(frozen=True, eq=False, repr=False)
class Inversion:
    """Solve response(controls, state) = measured for the state in [low, high] and look up `table` there.

    `tape`: controls and state to `count` responses, then their slopes by the state; the `index`-th is
    measured and `rising` with the state or falling. For compiled code: ``retrieve(packed, ...)``.
    `units`: the name of the response and its unit; for exports.

    Examples
    --------
    >>> import casadi
    >>> from sdpgrind.locus._problem.tape import tape
    >>> v, x = casadi.SX.sym("v"), casadi.SX.sym("x")
    >>> response = tape(casadi.Function("f", [v, x], [x * v, v]))
    >>> key = np.array([1.0, 2.0, 4.0])
    >>> table = LocusTable(key, np.column_stack([key**2]), np.column_stack([2 * key]))
    >>> Inversion(response, table, low=1.0, high=4.0).at(7.5, 2.5)
    (array([3., 9.]), False)
    """

    tape: Floats = field(repr=False)
    table: LocusTable
    low: float
    high: float
    rising: bool = True
    count: int = 1
    index: int = 0
    units: Mapping[str, str] = field(default_factory=dict)
    packed: Floats = field(init=False, repr=False)
    places: int = field(init=False, repr=False)

    def __post_init__(self) -> None:
        n = int(self.tape[:1].view(np.int64)[0]) - 1
        head = np.zeros(kernels.HEAD)
        whole = head.view(np.int64)
        whole[kernels.CONTROLS], whole[kernels.TAPE] = n, self.tape.size
        whole[kernels.RESPONSE], whole[kernels.SLOPE] = self.index, self.count + self.index
        head[kernels.LOW], head[kernels.HIGH] = self.low, self.high
        head[kernels.DIRECTION] = 1.0 if self.rising else -1.0
        middle = np.sqrt(self.low * self.high) if self.low > 0 else 0.5 * (self.low + self.high)
        head[kernels.GUESS] = kernels.off_ends(float(middle), float(self.low), float(self.high))
        object.__setattr__(self, "packed", np.concatenate([head, self.tape, self.table.packed]))
        object.__setattr__(self, "places", 1 + self.table.width)

    def __repr__(self) -> str:
        return f"Inversion(state in [{self.low:.6g}, {self.high:.6g}], {self.table!r})"

    def __export__(self) -> "Recipe":
        """Return what `sdpgrind.export` writes of it, in the user's units."""
        from sdpgrind.locus._curve.recipe import recipe_of

        return recipe_of(self.packed, self.table, self.units)

    def at(self, measured: float, *controls: float, out: Floats | None = None) -> tuple[Floats, bool]:
        """Return state and table columns (1 + n,), in `out` if given, and whether the state is clamped.

        Raises ValueError when the response `measured` is NaN or the model has none at the `controls`.
        """
        if out is None:
            out = np.empty(self.places)
        for each in controls:
            if type(each) is not float:  # compiled code takes floats alone
                controls = tuple(map(float, controls))
                break
        flag = retrieve(self.packed, controls, float(measured), out)
        if flag == NO_KEY:
            raise self._nothing(measured, controls)
        return out, flag != INSIDE

    def _nothing(self, measured: Any, controls: Any) -> ValueError:
        if np.isnan(measured):
            return checks.refuse("response", "a number, no NaN", measured)
        return ValueError(
            f"controls must be where the model has a response; it has none at {', '.join(map(str, controls))}"
        )
