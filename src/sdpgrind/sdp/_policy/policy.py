"""Policy: solved table with look-up by state, pictures and files."""

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cached_property
from math import nan
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import numpy.typing as npt
import xarray as xr

from sdpgrind.base import checks, pictures, stored
from sdpgrind.base.checks import Floats
from sdpgrind.base.plans import Plan
from sdpgrind.base.rng import Seed
from sdpgrind.sdp._policy import look_up_kernels as _lookup
from sdpgrind.sdp._policy.single import SingleStates
from sdpgrind.sdp._policy.table import Solution
from sdpgrind.sdp._problem.coordinates import Stages
from sdpgrind.sdp._problem.grid import Grid
from sdpgrind.sdp._problem.layout import Layout
from sdpgrind.sdp._problem.problem import Problem
from sdpgrind.sdp._solve.kinks import Kinks
from sdpgrind.sdp._solve.stages import TABLES, StageTable

if TYPE_CHECKING:
    from sdpgrind.codegen import Recipe, TablesAsked

# measured: over the estimate the error by the levels was at most 3.0 in 220 random problems of shifts with 6
# to 50 levels, below 2.5 in 217 of them, below 1 in 152; of sampled moves it is 0.2 to 0.6
SEARCH_COVERS = 2.5


def _is_one(x: Any) -> bool:
    """Whether a coordinate is a single number."""
    return isinstance(x, float | int) and type(x) is not bool


@dataclass(frozen=True)
class Action:
    """Action of a policy; every field is an array for arrays of states.

    Attributes
    ----------
    stop : bool
        Whether to stop.
    name : str
        Name of the stop or move.
    duration : float
        Time of the move, in the stages' unit (0 for a stop).
    controls : dict
        Values of all moves' controls (NaN: move not chosen); also attributes of the action.
    gap : float
        Extra cost of the best other move or stop, $.
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
            f"an action has stop, name, duration, gap and the controls {', '.join(controls)}; "
            f"it has no {name!r}",
            name=name,
            obj=self,
        )


class Policy(Solution, Plan):
    """Solved problem, made by `plan`; immutable.

    A file holds the data for look-ups, not the functions of the problem.

    Attributes
    ----------
    problem : Problem or None
        Solved problem; None after loading if it is made of functions.
    layout : Layout
        Names, axes and stages as plain data.
    error : float or None
        Estimated error of the value-to-go ($), of grid and search; None: solved on a single grid.
    error_away : float or None
        Estimated error of the value-to-go ($) over one cell from where the over side of a charge jumps. None:
        none does, or the under side does, which is felt everywhere.
    status : str
        Why no finer grid was solved: "given grid", "tolerance reached", "time limit", "memory limit", "finest
        grid", or "out of reach" where halving the cells does not help enough.
    """

    kind = "sdp.policy"

    def __init__(
        self, problem: Problem | None, layout: Layout, table: StageTable, error: float | None
    ) -> None:
        super().__init__(problem, layout, table)
        self.error, self.status = error, "given grid"
        self.error_away: float | None = None

    @classmethod
    def _unfilled(cls, problem: Problem) -> Self:
        """Policy of a problem without a late side whose table its caller fills, from a closed form."""
        assert isinstance(problem.stages, Stages) and problem.stages.late is None
        grid, modes = Grid.of(problem), len(problem.modes)
        table = StageTable.empty(0, problem.stages.count + 1, modes, grid.size)
        return cls(problem, Layout.of(problem, grid, has_base=False), table, None)

    @property
    def search_error(self) -> float:
        """Error of the value-to-go ($) by the search between levels of a control; the true one is below in 95
        of 100 problems and more. 0: nothing is searched.

        It is that of this grid of levels alone, 2.5 times the estimate by which `plan` refines; `error` holds
        the estimate beside the error of the grid, whose estimate is wide.
        """
        return SEARCH_COVERS * self.table.search_error

    # -- looking up --------------------------------------------------------------------------------

    def value(self, **state: Any) -> Any:
        """Return the expected penalty-to-go ($) at states.

        Parameters
        ----------
        **state
            Coordinates, stage coordinate and, with modes, ``mode`` (name or number; default: the first);
            numbers or arrays. Between stages the stage below (fewer left) answers.

        Returns
        -------
        float or array

        Raises
        ------
        ValueError
            For a state outside the table.
        """
        found = self._at_one(state, SingleStates.value)
        if found is not None:
            return found
        place = self.locate(state)
        return _shaped(self.value_at(place), place.shape)

    def gradient(self, **state: Any) -> Any:
        """Return the derivative of the value-to-go by each axis, $ per its unit; see `value` for states.

        Interpolated central differences of the table: second order for a smooth value-to-go, a blend of both
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
        """Return the action at states; see `value`. Its gap is in $, its controls in their own units."""
        found = self._at_one(state, SingleStates.act)
        if found is not None:
            return self._action(*found[1:])
        place = self.locate(state)
        best, entry, control, gap = self.act(place)
        names, durations = map(np.array, self._choices)
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
    def single(self) -> SingleStates | None:
        """Look-ups of single states, $; None: the table has too many axes for them."""
        return SingleStates.of(self)

    def _at_one(self, state: dict[str, Any], look_up: Callable[..., Any]) -> Any:
        """Answer for a state of numbers; None: the arrays are to be asked, which also refuse it."""
        single, layout = self.single, self.layout
        names = self._names
        if single is None or len(state) - ("mode" in state) != len(names):
            return None
        try:
            numbers = [state[name] for name in names]
        except KeyError:
            return None
        mode = state.get("mode", 0)
        if isinstance(mode, str) and mode in layout.modes:
            mode = layout.modes.index(mode)
        if not (all(map(_is_one, numbers)) and isinstance(mode, int)):
            return None
        if not 0 <= mode < len(layout.modes):
            return None
        time = 0.0 if layout.endless else float(numbers.pop())
        return look_up(single, time, *map(float, numbers), mode=int(mode))

    @cached_property
    def _names(self) -> tuple[str, ...]:
        """Names of the coordinates, the stage coordinate last."""
        layout = self.layout
        return (*(axis.name for axis in layout.axes), *([] if layout.endless else [layout.stage_name]))

    def _action(self, best: int, entry: int, control: float, gap: float) -> Action:
        """Action at one state."""
        names, durations = self._choices
        which = best + len(self.layout.stops) if best >= 0 else -1 - best
        controls = dict.fromkeys(self._controls, nan)
        if best >= 0:
            move = self.layout.moves[best]
            controls |= {name: float(values[entry]) for name, values in move.lists}
            controls |= {move.level: control} if move.level else {}
        return Action(best < 0, names[which], durations[which], controls, gap)

    @cached_property
    def _choices(self) -> tuple[list[str], list[float]]:
        """Names and durations of the stops, then of the moves."""
        stops, moves, step = self.layout.stops, self.layout.moves, self.layout.step or 1.0
        return [*stops, *(m.name for m in moves)], [0.0] * len(stops) + [m.duration * step for m in moves]

    @cached_property
    def _controls(self) -> list[str]:
        """Names of all moves' controls."""
        names = [[name for name, _ in m.lists] + ([m.level] if m.level else []) for m in self.layout.moves]
        return list(dict.fromkeys(name for some in names for name in some))

    @cached_property
    def _slopes(self) -> list[Floats]:
        value = self.table.value.reshape(*self.table.value.shape[:2], *self.grid.shape)
        slopes = [
            np.gradient(value, x, axis=k + 2, edge_order=2) for k, x in enumerate(self.grid.coordinates)
        ]
        return [slope.reshape(self.table.value.shape) for slope in slopes]

    def __export__(self) -> "Recipe":
        """Return what `sdpgrind.export` writes of it."""
        from sdpgrind.codegen import TablesAsked

        return self.__export_tables__(TablesAsked())

    def __export_tables__(self, asked: "TablesAsked") -> "Recipe":
        """Return the same with tables as asked: rounded, without the gap ($), with the value ($)."""
        from sdpgrind.sdp._policy.recipe import recipe_of

        return recipe_of(self, asked)

    # -- predicting --------------------------------------------------------------------------------

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
        """Simulate the policy on the model, by Monte-Carlo.

        Parameters
        ----------
        runs : int
            Number of runs.
        rng : int, SeedSequence or Generator
            Source of randomness; results do not depend on the executor.
        problem : Problem, optional
            True process, with the same axes and moves. Default: the solved problem.
        snap : bool
            Put every outcome on a neighbour node at random: the mean penalty is then exactly the table's
            value. False: continuous states.
        noise : mapping, optional
            Standard deviation of measured coordinates by name, in their units: decisions use the measured,
            charges the true state.
        executor : concurrent.futures.Executor, optional
            Executor for blocks of runs.
        **state
            Initial state.

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
        """Return the distribution of the final penalty ($) from one state, by forward recursion on nodes.

        Exact for the process that the table solves. For moves smaller than a cell, give finer `nodes` of the
        only axis (its unit, from end to end) for the probability.
        """
        from sdpgrind.sdp._policy.distribution import distribution

        return distribution(self, state, nodes)

    def alternatives(self, within: float, **state: Any) -> dict[str, float]:
        """Return the cost ($) of each stop and move within `within` $ of the best at one state."""
        from sdpgrind.sdp._policy.alternatives import alternatives

        return alternatives(self, within, state)

    # -- keeping -----------------------------------------------------------------------------------

    @cached_property
    def dataset(self) -> xr.Dataset:
        """Table with labels and units (dimensions: stage, mode, axes)."""
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
        off_jumps = {} if self.error_away is None else {"error_away": self.error_away}
        tables = {name: (dims, array.reshape(shape), note) for name, (array, note) in described.items()}
        return xr.Dataset(
            tables | self._kink_variables(),
            {
                **coordinates,
                "mode": ("mode", list(layout.modes)),
                "stage": ("stage", times, {"units": layout.stage_unit, "long_name": layout.stage_name}),
            },
            attrs | ({} if self.error is None else {"error": self.error, "status": self.status} | off_jumps),
        )

    def _kink_variables(self) -> dict[str, Any]:
        """Variables of the kinks; none if there are no kinks (a file cannot hold empty arrays)."""
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
        """Rebuild a policy from its `dataset`, and its `problem` if known."""
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
        policy.status = str(dataset.attrs.get("status", policy.status))
        off_jumps = dataset.attrs.get("error_away")
        policy.error_away = None if off_jumps is None else float(off_jumps)
        if "kink" in dataset:
            names = ("kink", "line_start", "line_cost", "line_control", "line_act", "line_entry")
            policy.kinks = Kinks(*(np.ascontiguousarray(dataset[name].values) for name in names))
        return policy

    def plot(self, mode: str | int = 0) -> Any:
        """Return a figure of value-to-go and actions of one mode (one axis: over stage; two: last slice)."""
        return pictures.drawn("sdpgrind.sdp._policy.picture:plot", self, int(self.locator.mode(mode)))

    def _told(self) -> str:
        size = " x ".join(str(n) for n in (*self.table.value.shape[:2], *self.grid.shape))
        error = "not estimated" if self.error is None else f"{self.error:.2g} $"
        return f"stages x modes x nodes = {size}, error {error}"


def _shaped(values: Any, shape: tuple[int, ...]) -> Any:
    return values.reshape(shape) if shape else values.item()
