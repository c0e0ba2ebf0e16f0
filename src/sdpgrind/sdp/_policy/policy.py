"""Policy: the solved table, looked up by state, plotted, saved and loaded."""

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any, Self

import numpy as np
import numpy.typing as npt
import xarray as xr

from sdpgrind.base import checks, pictures, stored
from sdpgrind.base.checks import Floats
from sdpgrind.base.plans import Plan
from sdpgrind.base.rng import Seed
from sdpgrind.sdp._policy import look_up_kernels as _lookup
from sdpgrind.sdp._policy.table import Solution
from sdpgrind.sdp._problem.layout import Layout
from sdpgrind.sdp._problem.problem import Problem
from sdpgrind.sdp._solve.kinks import Kinks
from sdpgrind.sdp._solve.stages import TABLES, StageTable


@dataclass(frozen=True)
class Action:
    """What a policy says to do; for arrays of states every field is an array.

    Attributes
    ----------
    stop : bool
        Whether to stop.
    name : str
        Name of the stop or move.
    duration : float
        Time the move takes, in the stages' unit (0 for a stop).
    controls : dict
        Values of the move's controls (NaN where another move, or none, is chosen); also attributes of the action.
    gap : float
        By how much ($) the best alternative among the other moves and stops is worse.
    """

    stop: Any
    name: Any
    duration: Any
    controls: dict[str, Any]
    gap: Any

    def __getattr__(self, name: str) -> Any:
        controls = self.__dict__.get("controls", {})
        if name in controls:
            return controls[name]
        raise AttributeError(
            f"an action has stop, name, duration, gap and the controls {', '.join(controls)}; it has no {name!r}",
            name=name,
            obj=self,
        )


class Policy(Solution, Plan):
    """A solved problem; made by `plan`, immutable.

    A file holds what look-ups need; functions of the problem cannot be saved.

    Attributes
    ----------
    problem : Problem or None
        What was solved (None after loading a problem made of functions, which no file can hold).
    layout : Layout
        Names, axes and stages as plain data.
    error : float or None
        Estimated distance of the value-to-go from the converged one ($), grid and search together; None where a single
        grid was solved.
    """

    kind = "sdp.policy"

    def __init__(
        self, problem: Problem | None, layout: Layout, table: StageTable, error: float | None
    ) -> None:
        super().__init__(problem, layout, table)
        self.error = error

    # -- looking up ------------------------------------------------------------------------------------------------

    def value(self, **state: Any) -> Any:
        """Return the expected penalty-to-go ($) at states.

        Parameters
        ----------
        **state
            The coordinates, the stage coordinate and, where there are modes, ``mode`` (name or number; the first by
            default); numbers or arrays. Between stages the answer is that of the stage below (fewer left).

        Returns
        -------
        float or array

        Raises
        ------
        ValueError
            Where a state lies outside the table.
        """
        place = self.locate(state)
        return _shaped(self.value_at(place), place.shape)

    def gradient(self, **state: Any) -> Any:
        """Return the derivative of the value-to-go with respect to each axis, $ per its unit; see `value` for states.

        Central differences of the table, interpolated: second order where the value-to-go is smooth, a blend of both
        sides within a cell of a kink.

        Returns
        -------
        dict of float or array
            By name of the axis.
        """
        place = self.locate(state)
        out = {}
        for k, axis in enumerate(self.layout.axes):
            slope = np.empty(place.row.size)
            _lookup.interpolate(self._slopes[k], place.row, place.mode, self.shape, place.index, slope)
            out[axis.name] = _shaped(self.locator.with_exit_slopes(place, slope), place.shape)
        return out

    def action(self, **state: Any) -> Action:
        """Return what to do at states; see `value`. Its gap is in $, its controls in their own units."""
        place = self.locate(state)
        best, entry, control, gap = self.act(place)
        durations = np.array(
            [0.0] * len(self.layout.stops)
            + [m.duration * (self.layout.step or 1.0) for m in self.layout.moves]
        )
        names = np.array([*self.layout.stops, *(m.name for m in self.layout.moves)])
        which = np.where(best < 0, -1 - best, best + len(self.layout.stops))
        shape = place.shape
        controls = {
            name: _shaped(values, shape) for name, values in self.controls(best, entry, control).items()
        }
        name = names[which].reshape(shape)
        return Action(
            _shaped(best < 0, shape),
            str(name) if not shape else name,
            _shaped(durations[which], shape),
            controls,
            _shaped(gap, shape),
        )

    @cached_property
    def _slopes(self) -> list[Floats]:
        value = self.table.value.reshape(*self.table.value.shape[:2], *self.grid.shape)
        slopes = [
            np.gradient(value, x, axis=k + 2, edge_order=2) for k, x in enumerate(self.grid.coordinates)
        ]
        return [slope.reshape(self.table.value.shape) for slope in slopes]

    # -- predicting ------------------------------------------------------------------------------------------------

    def simulate(
        self,
        *,
        runs: int = 10_000,
        rng: Seed = 0,
        problem: Problem | None = None,
        snap: bool = False,
        noise: Mapping[str, float] = MappingProxyType({}),
        executor: Executor | None = None,
        **state: Any,
    ) -> Any:
        """Follow the policy on the model, by Monte-Carlo (no machine, no sensor).

        Parameters
        ----------
        runs : int
            Number of runs.
        rng : int, SeedSequence or Generator
            Source of randomness; results depend on it and on `runs`, not on the executor.
        problem : Problem, optional
            Another truth, with the same axes and moves.
        snap : bool
            Put every outcome on one of its neighbour nodes at random, as the table's interpolation does: the mean is then
            exactly the table's value. False: states are continuous, as in life.
        noise : mapping, optional
            Standard deviation of the measured coordinates by their names, in their units: the policy decides by what is
            measured, and is charged by what is.
        executor : concurrent.futures.Executor, optional
            Where to run blocks of runs.
        **state
            Where to start (one state).

        Returns
        -------
        Runs
            Penalty ($), moves and final state of each run.
        """
        from sdpgrind.sdp._policy.simulate import simulate

        for name, sd in noise.items():
            axis = checks.one_of("noise", name, [axis.name for axis in self.layout.axes])
            checks.nonnegative(f"noise[{axis!r}]", sd)
        return simulate(self, runs, rng, problem, snap, executor, state, noise)

    def distribution(self, *, nodes: npt.ArrayLike | None = None, **state: Any) -> Any:
        """Return the distribution of the final penalty ($) from one state, by a forward recursion on the table's nodes.

        So it is exact for the process that the table solves. `nodes` (of the only axis, in its unit, from end to end) carry the
        probability instead where moves are smaller than a cell.
        """
        from sdpgrind.sdp._policy.distribution import distribution

        return distribution(self, state, nodes)

    def alternatives(self, within: float, **state: Any) -> dict[str, float]:
        """Return the stops and moves that cost at most `within` $ more than the best, with what each costs ($), at one state."""
        from sdpgrind.sdp._policy.alternatives import alternatives

        return alternatives(self, within, state)

    # -- keeping ---------------------------------------------------------------------------------------------------

    @cached_property
    def dataset(self) -> xr.Dataset:
        """The table with labels and units (dimensions: stage, mode, axes)."""
        layout, t = self.layout, self.table
        dims = ("stage", "mode", *(axis.name for axis in layout.axes))
        shape = (*t.value.shape[:2], *self.grid.shape)
        level = [m.level for m in layout.moves if m.level]
        described: dict[str, tuple[Any, dict[str, str]]] = {
            "value": (t.value, {"units": "$", "long_name": "expected penalty-to-go"}),
            "best": (
                t.best,
                {
                    "long_name": "stops -1, -2, ... then moves 0, 1, ...",
                    "stops": ", ".join(layout.stops),
                    "moves": ", ".join(m.name for m in layout.moves),
                },
            ),
            "move": (
                t.move,
                {"long_name": "best move, also where it is better to stop (-1: none is allowed)"},
            ),
            "entry": (t.entry, {"long_name": "entry of the move's lists of controls"}),
            "control": (
                t.control,
                {"long_name": "continuous control: " + (", ".join(sorted(set(level))) or "none")},
            ),
            "gap": (t.gap, {"units": "$", "long_name": "how much worse the best alternative is"}),
        }
        coordinates = {
            axis.name: (axis.name, x, {"units": axis.unit})
            for axis, x in zip(layout.axes, self.grid.coordinates, strict=True)
        }
        times = self.countdown.time(np.arange(t.value.shape[0]))
        attrs = {
            "layout": stored.encode(layout),
            "first": self.countdown.first,
            "search_error": t.search_error,
        }
        tables = {name: (dims, array.reshape(shape), note) for name, (array, note) in described.items()}
        return xr.Dataset(
            tables | self._kink_variables(),
            {
                **coordinates,
                "mode": ("mode", list(layout.modes)),
                "stage": ("stage", times, {"units": layout.stage_unit, "long_name": layout.stage_name}),
            },
            attrs | ({} if self.error is None else {"error": self.error}),
        )

    def _kink_variables(self) -> dict[str, Any]:
        """Where the action changes inside cells; nothing where that is nowhere (a file cannot hold empty arrays)."""
        k = self.kinks
        if k.start.size < 2:
            return {}
        return {
            "kink": (
                ("stage", "mode", "cell"),
                k.at,
                {"long_name": "number of a cell in which the action changes (-1: none)"},
            ),
            "line_start": (("kink_end",), k.start, {"long_name": "first line of each such cell"}),
            "line_cost": (
                ("line", "end"),
                k.cost,
                {"units": "$", "long_name": "cost of an action at both ends of the cell"},
            ),
            "line_control": (("line", "end"), k.control, {"long_name": "its continuous control"}),
            "line_act": (("line",), k.act, {"long_name": "its stop (-1, -2, ...) or move (0, 1, ...)"}),
            "line_entry": (("line",), k.entry, {"long_name": "its entry of the move's lists of controls"}),
        }

    @classmethod
    def restored(cls, dataset: xr.Dataset) -> Self:
        return cls.from_dataset(dataset, None)

    @classmethod
    def from_dataset(cls, dataset: xr.Dataset, problem: Problem | None) -> Self:
        """Rebuild a policy from its `dataset`, for `problem` where that is known."""
        if missing := {*TABLES} - {*dataset.data_vars}:
            raise ValueError(
                f"the file was saved by another version, it lacks {', '.join(sorted(missing))}: plan again"
            )
        layout: Layout = stored.decode(dataset.attrs["layout"])
        shape = (dataset.sizes["stage"], dataset.sizes["mode"], -1)
        first, search_error = int(dataset.attrs["first"]), float(dataset.attrs["search_error"])
        arrays: dict[str, Any] = {
            name: np.ascontiguousarray(dataset[name].values.reshape(shape)) for name in TABLES
        }
        table = StageTable(first=first, search_error=search_error, **arrays)
        error = dataset.attrs.get("error")
        found = None if error is None else float(error)
        policy = cls(problem, layout, table, found)
        if "kink" in dataset:
            names = ("kink", "line_start", "line_cost", "line_control", "line_act", "line_entry")
            policy.kinks = Kinks(*(np.ascontiguousarray(dataset[name].values) for name in names))
        return policy

    def plot(self, mode: str | int = 0) -> Any:
        """Draw value-to-go and actions of one mode (one axis: against stage; two: the last slice); return the figure."""
        return pictures.drawn("sdpgrind.sdp._policy.plot:plot", self, int(self.locator.mode(mode)))

    def _told(self) -> str:
        size = " x ".join(str(n) for n in (*self.table.value.shape[:2], *self.grid.shape))
        error = "not estimated" if self.error is None else f"{self.error:.2g} $"
        return f"stages x modes x nodes = {size}, error {error}"


def _shaped(values: Any, shape: tuple[int, ...]) -> Any:
    return values.reshape(shape) if shape else values.item()
