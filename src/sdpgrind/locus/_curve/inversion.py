"""From one measurement to the best point: the hidden state by inversion of the response, then a table by the state."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.locus._curve.inversion_kernels import (
    CONTROLS,
    DIRECTION,
    GUESS,
    HEAD,
    HIGH,
    LOW,
    RESPONSE,
    SLOPE,
    TAPE,
    retrieve,
)
from sdpgrind.locus._trace.table import LocusTable
from sdpgrind.locus._trace.table_kernels import INSIDE, NO_KEY


@dataclass(frozen=True, eq=False, repr=False)
class Inversion:
    """Solves response(controls, state) = measured for the state, and looks up the table there.

    `packed` is all of it in one flat array, for compiled code: ``retrieve(packed, controls, measured, out)``.

    Parameters
    ----------
    tape : array
        Of controls and state: responses, then their slopes by the state.
    table : Table
        By the state.
    low, high : float
        Range of the state.
    rising : bool
        Whether the response rises with the state, everywhere.
    count, index : int
        How many responses the tape gives, and which of them is measured.

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
    packed: Floats = field(init=False, repr=False)
    places: int = field(init=False, repr=False)

    def __post_init__(self) -> None:
        n = int(self.tape[:1].view(np.int64)[0]) - 1
        head = np.zeros(HEAD)
        whole = head.view(np.int64)
        whole[CONTROLS], whole[TAPE] = n, self.tape.size
        whole[RESPONSE], whole[SLOPE] = self.index, self.count + self.index
        head[LOW], head[HIGH], head[DIRECTION] = self.low, self.high, 1.0 if self.rising else -1.0
        head[GUESS] = np.sqrt(self.low * self.high) if self.low > 0 else 0.5 * (self.low + self.high)
        object.__setattr__(self, "packed", np.concatenate([head, self.tape, self.table.packed]))
        object.__setattr__(self, "places", 1 + self.table.width)

    def __repr__(self) -> str:
        return f"Inversion(state in [{self.low:.6g}, {self.high:.6g}], {self.table!r})"

    def at(self, measured: float, *controls: float, out: Floats | None = None) -> tuple[Floats, bool]:
        """Return the state with the columns of the table there (1 + n,), and whether an end stands for what is out of reach.

        Parameters
        ----------
        measured : float
            Response, in its unit.
        *controls : float
            At which it was measured.
        out : array (1 + n,), optional
            Where the first is put, for loops in which nothing is to be made anew.

        Raises
        ------
        ValueError
            When the measurement is NaN, or the response has no value at the controls.
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
