"""The controller of several hidden states by several measured responses."""

from collections.abc import Mapping
from dataclasses import KW_ONLY, field
from functools import cached_property
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, custom, described, part, quantity
from sdpgrind.locus._control.area_walking import AreaWalking
from sdpgrind.locus._control.readings import check_period, checked_hold
from sdpgrind.locus._curve.area import Area
from sdpgrind.locus.gains._area_design import CONFIDENCE, by_response, margins, quantile


def _names(name: str, value: Any) -> tuple[str, ...]:
    given = (value,) if isinstance(value, str) else tuple(value)
    return checks.unique(name, given)


@described()
class AreaController(AreaWalking, Described):
    """Keep a process at its optimum over several hidden states: Koren's controller in several dimensions.

    The coordinates of the loop are the estimated hidden states; the controls are optimal for the estimate.
    Along the optima the slacks change with these coordinates like the responses with the hidden states, E_s.
    The gain matrix is ``theta`` times the inverse of E_s (see `decoupling_gains`): each sample removes the
    share theta of all errors, and no constraint disturbs another. The reading of an active constraint is
    compared with its limit, free of errors of the response model, that of an inactive one with the model.
    The estimate is clamped to the ranges of the hidden states, without wind-up.

    A response without a reading (NaN) moves nothing: what is measured once a part is kept in between. With
    measured controls (under their own names) or known lags, readings are compared with what is expected at
    the actual controls, and wait until these have settled.

    Parameters
    ----------
    curve : Area
        Optima over several hidden states, from `plan`.
    theta : float
        Share (0, 1] of each error removed per sample; see `design_gain`.
    start : "feasible", "learned" or mapping
        Initial estimate. "feasible": the corner of the range, or the point of a coarse grid, whose best
        controls exceed no limit for any hidden state of the range. "learned": the same, and after `reset` the
        last estimate (for parts run by `hwsim`, see `LearnedStart`). Mapping: each hidden state by name, in
        its unit.
    margin : "designed" or mapping
        Distance kept from each limit, by name of the response, in its unit; the optima are planned anew for
        it. "designed": z_conf (theta/(2 - theta))^(1/2) noise + drift/theta; 0 without noise and drift.
    noise, drift : mapping, optional
        Standard deviation of each reading, and greatest fall of each slack from one reading to the next, by
        name of the response, in its unit.
    confidence : float
        Probability [0.5, 1) that a sample keeps a limit, for the designed margin.
    hold : "none", "settled" or float
        Readings used by the law. "none": all. "settled": those with all actual controls within 5 % of their
        commands, or after 20 samples of waiting. Number: those later than this time after the start, s.
    lag : mapping, optional
        Time constant of a control behind its command, by name, s. Left out: no lag, or a measured control.
    per_part : str or sequence of str
        Names of controls that take effect at the start of a part only, such as a dressing lead: commanded
        then and held. The others are optimal for the held ones, as measured where they are measured.
    period : float, optional
        Sampling period, s. None: one sample per event of the plant.

    Raises
    ------
    ValueError
        When a value is out of range, a name is unknown, or no start is feasible in the whole range.
    TypeError
        When the curve is not an `Area`, or a mapping is none.

    Warns
    -----
    UserWarning
        When 20 readings in a row are explained by a hidden state beyond its range. Each such sample reports
        ``saturated``.

    Examples
    --------
    >>> from sdpgrind import locus
    >>> area = locus.plan(locus.preset("grinding-roughness"))
    >>> controller = locus.AreaController(area)
    >>> command = controller.step(grinding_power=1400.0, roughness=0.0008)  # W, mm
    >>> sorted(command)
    ['dressing_lead', 'infeed_rate', 'work_rotation']
    >>> noisy = locus.AreaController(area, theta=0.2, noise={"grinding_power": 10.0})  # W
    >>> round(noisy.margins["grinding_power"], 1)
    10.3
    """

    curve: Area = part(Area, ", as locus.plan gives it for several hidden states")
    _: KW_ONLY
    theta: float = quantity("1", above=0, at_most=1, default=0.5)
    start: Any = custom(default="feasible")
    margin: Any = custom(default="designed")
    noise: Mapping[str, float] = custom(default_factory=dict)
    drift: Mapping[str, float] = custom(default_factory=dict)
    confidence: float = custom(default=CONFIDENCE)
    hold: str | float = custom(checked_hold, default="settled")
    lag: Mapping[str, float] = custom(default_factory=dict)
    per_part: Any = custom(_names, default=())
    period: float | None = quantity("s", above=0, default=None)
    state: Floats = field(init=False, repr=False, compare=False)

    def _check(self) -> None:
        for name in ("noise", "drift"):
            by_response(name, getattr(self, name), self.curve)
        quantile(self.confidence)
        self._check_controls()
        check_period(self.period, self.hold, any(self.lag.values()))
        self._check_margins()
        object.__setattr__(self, "state", self.start_state.copy())

    def _check_controls(self) -> None:
        names = self.curve.names
        for name in checks.kind("lag", self.lag, dict, " of controls to time constants (s)"):
            checks.nonnegative(f"lag[{checks.one_of('lag', name, names)!r}]", self.lag[name], "s")
        for name in self.per_part:
            checks.one_of("per_part", name, names)
        if len(self.per_part) >= len(names):
            raise checks.refuse("per_part", "fewer than all controls, which leaves nothing to control", names)

    def _check_margins(self) -> None:
        """Refuse margins that leave nothing of a limit."""
        kept = {name: value for name, value in self.margins.items() if value}
        if not kept:
            return
        area, system = self.curve, self.curve.system
        controls = system.unscaled(area.grid.points[area.known][:, : system.n])
        limits = system.values(controls, system.unscaled(area.grid.places[area.known], system.n))[2]
        greatest = dict(zip(area.responses, np.max(limits, axis=0), strict=True))
        for name, value in kept.items():
            if value >= greatest[name]:
                rule = f"< {greatest[name]:.6g}, the greatest limit on the area"
                raise checks.refuse(f"margin[{name!r}]", rule, value, area.problem.unit(name))

    @cached_property
    def margins(self) -> Mapping[str, float]:
        """Distance kept from each limit, by name of the response, in its unit."""
        if isinstance(self.margin, str):
            checks.one_of("margin", self.margin, ("designed",))
            return margins(self.curve, self.theta, self.noise, self.drift, self.confidence)
        return by_response("margin", self.margin, self.curve)

    @property
    def reads(self) -> Mapping[str, str]:
        """Name of each measurement to its unit."""
        return {name: self.curve.problem.unit(name) for name in self.curve.responses}

    @property
    def commands(self) -> Mapping[str, str]:
        """Name of each control to its unit."""
        return {name: self.curve.problem.unit(name) for name in self.curve.names}

    @property
    def reports(self) -> Mapping[str, str]:
        """Name of each reported value to its unit."""
        problem = self.curve.problem
        hidden = {name: problem.unit(name) for name in problem.hidden_names}
        slacks = {f"{name}_slack": problem.unit(name) for name in self.curve.responses}
        return {**hidden, **slacks, "saturated": ""}

    @property
    def job(self) -> Mapping[str, object]:
        """Data of the job that plan and machine must share, in their units; empty for a process without."""
        return dict(getattr(self.curve.problem.model, "job", {}))
