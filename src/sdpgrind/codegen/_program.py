"""Quadratic program within a step: solved by OSQP in the library, by the code that OSQP generates in C."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.compiling.compiled import Kernel

_ITERATIONS = 4000  # source: OSQP 1.1, osqp_api_constants.h: max_iter
_SOLVED = 1  # source: OSQP 1.1, osqp_api_constants.h


@dataclass(frozen=True, eq=False)
class StepProgram:
    """Least of x'P x/2 + q'x with l <= A x <= u; q, l, u differ from step to step.

    In the units of the step (mm, N ...). Where an l is above its u it is not solved. Where both are closer
    than some 1e-4 once OSQP has scaled them, it takes them for an equation, but not in its C: other bits.

    Parameters
    ----------
    hessian : array, (n, n)
        P; its upper triangle counts.
    rows : array, (m, n)
        A.
    linear : array, (n,)
        Typical q, by which OSQP scales.
    settings : mapping
        Settings of OSQP; "adaptive_rho" must be False, "polishing" may not be True.
    free : float
        Stands for no bound: below what OSQP takes for infinite, as it treats such rows otherwise.
    behind : int
        Further numbers that a step keeps behind the program.
    finish : Kernel, optional
        In a `Recipe`: ``finish(state, *law, room, out)``, which ends the step and returns its status.

    Raises
    ------
    ValueError
        For settings by which C would not do the same.

    Examples
    --------
    >>> import numpy as np
    >>> settings = {"verbose": False, "adaptive_rho": False}
    >>> program = StepProgram(np.eye(1), np.eye(1), np.zeros(1), settings)
    >>> room = np.array([-2.0, 0.0, 1.0, 0.0])    # q, l, u, guess
    >>> program.solve(room)
    True
    >>> room.round(2).tolist()
    [-2.0, 0.0, 1.0, 1.0]
    """

    hessian: Floats
    rows: Floats
    linear: Floats
    settings: Mapping[str, Any] = field(default_factory=dict)
    free: float = 1e20
    behind: int = 0
    finish: Kernel | None = None

    def __post_init__(self) -> None:
        if self.settings.get("adaptive_rho", True):
            rule = "with adaptive_rho False: what adapts it by time depends on the clock"
            raise checks.refuse("settings", rule, dict(self.settings))
        if self.settings.get("polishing", False):
            raise checks.refuse("settings", "without polishing, which C leaves out", dict(self.settings))

    @property
    def iterations(self) -> int:
        """Greatest number of iterations of a step, unit 1."""
        return int(self.settings.get("max_iter", _ITERATIONS))

    def solver(self) -> Any:
        """Return a solver of OSQP, scaled for the typical q (N ...): no step depends on the one before it."""
        import osqp

        free = np.full(len(self.rows), self.free)
        made = osqp.OSQP()
        made.setup(
            P=scipy.sparse.csc_matrix(np.triu(self.hessian)), A=scipy.sparse.csc_matrix(self.rows),
            q=self.linear, l=-free, u=free, **self.settings,
        )  # fmt: skip
        return made

    @cached_property
    def _solver(self) -> Any:
        return self.solver()

    @property
    def sizes(self) -> tuple[int, int]:
        """Numbers of unknowns and bounds, unit 1."""
        return self.linear.size, len(self.rows)

    @property
    def width(self) -> int:
        """Size of the room of a step, unit 1: q, l, u, x, and what is behind."""
        n, m = self.sizes
        return 2 * (n + m) + self.behind

    @property
    def constants(self) -> tuple[Floats, Floats, Floats]:
        """P, A and the typical q, in the units of the program."""
        return self.hessian, self.rows, self.linear

    def parts(self, room: Floats) -> list[Floats]:
        """Return views of q, l, u and x in a `room`, in the units of the program."""
        n, m = self.sizes
        return np.split(room, np.cumsum([n, m, m, n]))[:4]

    def solve(self, room: Floats) -> bool:
        """Solve the program in a `room`, in its units, from the x there; put its solution there, if any.

        Return whether there is one.
        """
        linear, low, high, guess = self.parts(room)
        if not np.all(low <= high):
            return False  # OSQP would go on with the bounds before
        self._solver.update(q=linear, l=low, u=high)
        self._solver.warm_start(x=guess, y=np.zeros(low.size))
        result = self._solver.solve(raise_error=False)
        solved = bool(result.info.status_val == _SOLVED)
        if solved:
            guess[:] = result.x
        return solved

    def __getstate__(self) -> dict[str, Any]:
        # OSQP can be neither copied nor sent
        return {name: one for name, one in self.__dict__.items() if name != "_solver"}
