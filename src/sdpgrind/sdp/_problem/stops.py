"""Stop charges on the grid."""

from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._problem.charges import Charge
from sdpgrind.sdp._problem.coordinates import Stages
from sdpgrind.sdp._problem.grid import Grid, record
from sdpgrind.sdp._problem.moves import Stop
from sdpgrind.sdp._problem.problem import Problem


class StopCharges:
    """Charges of all stops at the nodes of a grid, [stop, mode, node], and those by mode beyond an edge."""

    def __init__(self, problem: Problem, grid: Grid) -> None:
        self.problem, self.grid = problem, grid
        self._each = [self._fixed(stop) for stop in problem.stops]
        self.still: Floats | None = (
            np.stack([q for q in self._each if q is not None])
            if all(q is not None for q in self._each) and self._each
            else None
        )
        self._level = self._levels()

    def at(self, stage: int, late: float) -> Floats:
        """Return [stop, mode, node] at a stage; infinite where stopping is not allowed."""
        if self.still is not None:
            return self.still + late
        shape = (len(self.problem.stops), len(self.problem.modes), self.grid.size)
        out = np.empty(shape)
        for k, (stop, still) in enumerate(zip(self.problem.stops, self._each, strict=True)):
            out[k] = (still if still is not None else self._evaluate(stop, self._state(stage))) + late
        return out

    def level(self, late: float = 0.0) -> Floats:
        """Return the charges [mode] of a stop beyond an edge besides that of the axis."""
        return self._level + late

    def largest(self) -> float:
        """Largest charge of stopping anywhere on the grid."""
        finite = self.at(0, 0.0)
        finite = finite[np.isfinite(finite)]
        return float(finite.max()) if finite.size else 0.0

    def _fixed(self, stop: Stop) -> Floats | None:
        """Charges independent of the stage, else None."""
        try:
            return self._evaluate(stop, self._state(None))
        except AttributeError as error:
            if isinstance(self.problem.stages, Stages) and error.name == self.problem.stages.name:
                return None
            raise

    def _state(self, stage: int | None) -> Any:
        return stop_state(
            self.problem,
            [x[None, :] for x in self.grid.points],
            np.arange(len(self.problem.modes))[:, None],
            stage,
        )

    def _evaluate(self, stop: Stop, s: Any) -> Floats:
        return np.broadcast_to(
            charge_of(self.problem, stop, s), (len(self.problem.modes), self.grid.size)
        ).astype(float, order="C")  # as values are: kernels are compiled for the order of their arrays

    def _levels(self) -> Floats:
        modes = np.arange(len(self.problem.modes))
        if not self.problem.stops or self.problem.stops[0].extra is None:
            return np.zeros(modes.size)
        fields = {"mode": modes} if modes.size > 1 else {}
        return np.broadcast_to(
            np.asarray(self.problem.stops[0].extra(record("S", tuple(fields))(**fields)), dtype=float),
            modes.shape,
        )


def stop_state(problem: Problem, points: Any, mode: Any, stage: Any) -> Any:
    """Return the ``s`` of stop callbacks: coordinates, mode if there are several, stage if known."""
    fields = {axis.name: x for axis, x in zip(problem.axes, points, strict=True)}
    if len(problem.modes) > 1:
        fields["mode"] = mode
    if stage is not None and isinstance(problem.stages, Stages):
        fields[problem.stages.name] = stage * problem.stages.step
    return record("S", tuple(fields))(**fields)


def charge_of(problem: Problem, stop: Stop, s: Any) -> Any:
    """Return the charge of `stop` at ``s``; infinite where it is not allowed."""
    charge = stop.charge(s[problem.stop_axis]) if isinstance(stop.charge, Charge) else stop.charge(s)
    if stop.extra is not None:
        charge = charge + stop.extra(s)
    return charge if stop.allowed is None else np.where(stop.allowed(s), charge, np.inf)
