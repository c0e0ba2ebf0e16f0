"""Coordinates of a problem: axes of the state, stages, levels of a control."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.stored import stored
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
