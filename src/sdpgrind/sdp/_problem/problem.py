"""Description of a problem: axes, moves, stops, stages, modes.

Callbacks get named tuples ``s`` (state coordinates; the stage coordinate of a ``timed`` move; ``mode``, a
whole number, of a problem with modes), ``c`` (controls) and ``e`` (noise). They are written elementwise
(operators and numpy functions, no ``if``): one body runs on floats in a compiled kernel and on broadcast
arrays in numpy.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks, notebook
from sdpgrind.base.checks import Floats
from sdpgrind.base.stored import stored
from sdpgrind.sdp._problem.charges import Charge
from sdpgrind.sdp._problem.one_sided import OneSided

Edge: TypeAlias = Literal["refuse", "hold", "stop"] | float
Callback: TypeAlias = Callable[..., Any]


@stored("sdp.axis")
@dataclass(frozen=True)
class Axis:
    """Continuous state coordinate on a uniform grid.

    Parameters
    ----------
    name : str
        Field of ``s`` in callbacks.
    low, high : float
        Ends of the grid, in `unit`.
    nodes : int
        Number of grid nodes >= 3.
    unit : str
        Unit of the coordinate.
    scale : {"linear", "log"}
        Nodes uniform in the coordinate or in its logarithm.
    below, above : {"refuse", "hold", "stop"} or float
        Treatment of a next state beyond the end: an error; clamped to the end; the process ends there,
        charged exactly by the `Charge` of the only stop; or a value-to-go of this number of $.
    """

    name: str
    low: float
    high: float
    nodes: int
    unit: str = ""
    scale: Literal["linear", "log"] = "linear"
    below: Edge = "refuse"
    above: Edge = "refuse"

    def __post_init__(self) -> None:
        checks.number(f"{self.name}.low", self.low, self.unit)
        if checks.number(f"{self.name}.high", self.high, self.unit) <= self.low:
            rule = checks.with_unit("> low", self.unit)
            raise ValueError(f"{self.name}.high must be {rule}; got {self.high!r} and {self.low!r}")
        checks.count(f"{self.name}.nodes", self.nodes, at_least=3)
        checks.one_of(f"{self.name}.scale", self.scale, ("linear", "log"))
        if self.scale == "log":
            checks.positive(f"{self.name}.low", self.low, self.unit)
        for side in (self.below, self.above):
            if isinstance(side, str):
                checks.one_of(f"{self.name}.below and .above", side, ("refuse", "hold", "stop"))
            elif np.isnan(side):
                raise ValueError(
                    f"{self.name}.below and .above must be a word or a value-to-go ($); got {side!r}"
                )

    @property
    def interval(self) -> str:
        """Interval in words, with its unit."""
        return checks.with_unit(f"[{self.low:g}, {self.high:g}]", self.unit)


@dataclass(frozen=True)
class Stages:
    """Countdown of `count` stages of length `step`, in time or another quantity.

    Parameters
    ----------
    count : int
        Number of stages from the start to the deadline.
    step : float
        Length of a stage, in `unit`.
    name, unit : str
        Field of the stage coordinate in ``s`` (of timed moves), and its unit.
    late : OneSided or callable, optional
        Charge ($) on the delay of the end, 0 at 0 and never falling. None: moves longer than the time left
        are inadmissible. `Linear`: late states are solved exactly for all times. `Quadratic`: a finite window
        suffices.
    late_window : float, optional
        Length of the late side of the table, in `unit`. Default: a provably sufficient one. A concave `late`
        (`Constant`, a plain function) requires it.
    """

    count: int
    step: float
    name: str = "time_left"
    unit: str = "s"
    late: OneSided | Callback | None = None
    late_window: float | None = None

    def __post_init__(self) -> None:
        checks.count("stages.count", self.count, at_least=0)
        checks.positive("stages.step", self.step, self.unit)
        if self.late_window is not None:
            checks.nonnegative("stages.late_window", self.late_window, self.unit)
        if self.late is not None and not callable(self.late):
            raise TypeError(f"stages.late must be a one-sided charge, a function or None; got {self.late!r}")
        if self.late is not None and not isinstance(self.late, OneSided):
            checks.charge("stages.late", self.late, self.late_window or 0.0)


@dataclass(frozen=True)
class Forever:
    """No deadline: moves until a stop or a stopping edge, without discount."""


@dataclass(frozen=True)
class Levels:
    """Continuous control: `count` levels, refined by search inside each regime.

    Parameters
    ----------
    low, high : float
        Interval of the control, in its own unit.
    count : int
        Number of levels, in all regimes. They are dense at the ends of each (Chebyshev-Lobatto points).
    breaks : sequence of float
        Interior values at which the law or the charge has a kink: each is a level, and no search crosses it.
    search : bool
        False: only the levels are allowed (a finite Markov decision process).
    """

    low: float
    high: float
    count: int = 401
    breaks: Sequence[float] = ()
    search: bool = True

    def __post_init__(self) -> None:
        checks.number("Levels.low", self.low)
        if checks.number("Levels.high", self.high) < self.low:
            raise ValueError(f"Levels.high must be >= low; got {self.high!r} and {self.low!r}")
        checks.count("Levels.count", self.count, at_least=1)


class Transition(Protocol):
    """Change of the coordinates by a move: `Shift`, `Sampled`, `Stay`, or a class with these two methods.

    Both get P points, with an entry of the move's lists and a value of its continuous control for each;
    `menu.state` and `menu.controls` make ``s`` and ``c`` of them.
    """

    def rows(
        self, menu: Any, points: tuple[Floats, ...], mode: Any, stage: Any, choice: Any, level: Floats
    ) -> Any:
        """Return the exact one-step distribution, in-path charges ($) included.

        Parameters
        ----------
        menu : object
            Provides ``state``, ``controls``, ``penalty``, ``grid``.
        points : tuple of array
            Coordinates, one array (P,) for each axis, in its unit.
        mode, stage : array or None
            Mode and stage coordinate of each point; mode None: the problem has only one.
        choice, level : array
            Entry of the move's lists, and value of its continuous control, of each point.
        """

    def sample(
        self,
        menu: Any,
        points: tuple[Floats, ...],
        mode: Any,
        stage: Any,
        choice: Any,
        level: Floats,
        rng: np.random.Generator,
    ) -> tuple[tuple[Floats, ...], Any]:
        """Draw next coordinates, and charges ($) besides the move's own charge.

        Parameters
        ----------
        menu, points, mode, stage, choice, level
            As in `rows`.
        rng : numpy Generator
            Source of randomness.
        """


@dataclass(frozen=True)
class Move:
    """Action that changes the state.

    Parameters
    ----------
    name : str
        Name in the policy.
    controls : mapping
        At most one `Levels`; all others are lists of equal length, combined entry by entry.
    to : Transition
        Change of the coordinates.
    duration : int
        Number of stages, >= 1.
    charge : float or callable(s, c)
        In-path charge, $.
    allowed : callable(s, c), optional
        Whether the move is allowed.
    into : str or sequence of str, optional
        Mode on arrival: one, or one for each entry of the lists. None: unchanged.
    timed : bool
        True: ``s`` has the stage coordinate, and the move is evaluated anew at every stage.
    """

    name: str
    controls: Mapping[str, Levels | npt.ArrayLike]
    to: Transition
    duration: int = 1
    charge: float | Callback = 0.0
    allowed: Callback | None = None
    into: str | Sequence[str] | None = None
    timed: bool = False

    def __post_init__(self) -> None:
        checks.count(f"move {self.name!r}: duration", self.duration, at_least=1)
        if not callable(self.charge):
            checks.number(f"move {self.name!r}: charge", self.charge, "$, or a function of s and c")
        levels = [name for name, control in self.controls.items() if isinstance(control, Levels)]
        if len(levels) > 1:
            raise ValueError(f"move {self.name!r}: controls must have at most one Levels; got {levels}")
        lengths = {
            name: np.size(np.asarray(entry)) for name, entry in self.controls.items() if name not in levels
        }
        if len(set(lengths.values())) > 1:
            raise ValueError(f"move {self.name!r}: lists of controls must be of equal length; got {lengths}")
        if 0 in lengths.values():
            raise ValueError(f"move {self.name!r}: lists of controls must not be empty; got {lengths}")

    @property
    def level_name(self) -> str | None:
        """Name of the continuous control, or None."""
        return next((name for name, control in self.controls.items() if isinstance(control, Levels)), None)

    @property
    def levels(self) -> Levels | None:
        """The continuous control, or None."""
        return next((control for control in self.controls.values() if isinstance(control, Levels)), None)

    @property
    def lists(self) -> dict[str, Floats]:
        """Listed controls, as arrays of equal length."""
        return {k: np.ravel(np.asarray(v)) for k, v in self.controls.items() if not isinstance(v, Levels)}

    @property
    def choices(self) -> int:
        """Number of entries of the lists; 1 without lists."""
        return next((entry.size for entry in self.lists.values()), 1)


@dataclass(frozen=True)
class Stop:
    """Action that ends the process.

    Parameters
    ----------
    name : str
        Name in the policy.
    charge : Charge or callable(s)
        Charge, $. A `Charge` is applied to the coordinate of the one axis; an edge "stop" requires it.
    extra : callable(s), optional
        Further charge ($) by mode, also beyond a stopping edge.
    allowed : callable(s), optional
        Whether stopping is allowed.
    """

    name: str
    charge: Charge | Callback
    extra: Callback | None = None
    allowed: Callback | None = None


@dataclass(frozen=True)
class Problem:
    """Problem for the solver: axes, moves, stops, stages and modes.

    Parameters
    ----------
    axes : sequence of Axis
        Zero to three continuous coordinates.
    moves : sequence of Move
        Moves, in the order in which ties are broken.
    stops : sequence of Stop
        Stops; they win ties with moves.
    stages : Stages or Forever
        Countdown.
    modes : sequence of str
        Names of the discrete part of the state. In callbacks ``s.mode`` is the number of the mode in this
        order, a whole number or an array.
    """

    axes: Sequence[Axis]
    moves: Sequence[Move]
    stops: Sequence[Stop]
    stages: Stages | Forever
    modes: Sequence[str] = ("",)

    def __post_init__(self) -> None:
        for name in ("axes", "moves", "stops", "modes"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        if len(self.axes) > 3:
            raise ValueError(f"axes must be at most 3; got {len(self.axes)}")
        checks.unique("axes", [axis.name for axis in self.axes])
        checks.unique("modes", self.modes)
        names = [stop.name for stop in self.stops] + [move.name for move in self.moves]
        checks.unique("names of stops and moves", names)
        if not self.moves:
            raise ValueError("moves must hold at least one Move; got none")
        self._check_modes()
        self._check_edges()

    def _check_modes(self) -> None:
        for move in self.moves:
            into = (move.into,) if isinstance(move.into, str) else tuple(move.into or ())
            for name in into:
                checks.one_of(f"move {move.name!r}: into", name, self.modes)
            if not isinstance(move.into, str) and into and len(into) != move.choices:
                raise ValueError(
                    f"move {move.name!r}: "
                    f"into must name {move.choices} modes, one for each control; got {len(into)}"
                )
            if move.timed and isinstance(self.stages, Forever):
                raise ValueError(f"move {move.name!r}: timed must be False where stages is Forever; got True")

    def _check_edges(self) -> None:
        stopping = [axis.name for axis in self.axes if "stop" in (axis.below, axis.above)]
        exact = len(self.axes) == 1 and len(self.stops) == 1 and isinstance(self.stops[0].charge, Charge)
        two_axes = len(stopping) == 1 and len(self.stops) == 1 and isinstance(self.stops[0].charge, Charge)
        if stopping and not (exact or two_axes):
            raise ValueError(
                f"the edge 'stop' of {stopping[0]!r} needs exactly one Stop "
                "whose charge is a Charge of that axis"
            )

        numbers = [
            axis.name
            for axis in self.axes
            if not isinstance(axis.below, str) or not isinstance(axis.above, str)
        ]
        if numbers and isinstance(self.stages, Stages) and self.stages.late is not None:
            raise ValueError(
                f"the ends of the axis {numbers[0]!r} must not be numbers beside a late charge,"
                " which they would not bear; use 'stop'"
            )

    @property
    def stop_axis(self) -> int:
        """Index of the axis of a `Charge`: the one with a stopping edge, else the first."""
        return next((k for k, axis in enumerate(self.axes) if "stop" in (axis.below, axis.above)), 0)

    @property
    def step(self) -> float:
        """Length of a stage, in the unit of the stages (0 for `Forever`)."""
        return self.stages.step if isinstance(self.stages, Stages) else 0.0

    def _repr_html_(self) -> str:
        rows = [
            *(("axis", axis.name, f"{axis.low:g} to {axis.high:g}", axis.unit) for axis in self.axes),
            *(("stop", stop.name, "", "") for stop in self.stops),
            *(("move", move.name, ", ".join(move.controls), "") for move in self.moves),
        ]
        head = ("part", "name", "range or controls", "unit")
        return notebook.table(f"Problem, {self.stages!r}", head, rows)
