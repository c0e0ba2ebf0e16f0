"""The controller of several hidden states by several measured responses."""

from collections.abc import Mapping
from dataclasses import KW_ONLY, field

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.controllers import Stateful
from sdpgrind.base.quantities import Described, custom, described, part, quantity
from sdpgrind.locus._control.walking import usable
from sdpgrind.locus._curve.area import Area
from sdpgrind.locus._curve.point import Point
from sdpgrind.locus._problem.tape_kernels import run_many


@described()
class AreaController(Stateful, Described):
    """Keep a process at its optimum over several hidden states: Koren's controller in several dimensions.

    The coordinates of the loop are the estimated hidden states; the controls are optimal for the estimate.
    Along the optima the slacks change with these coordinates like the responses with the hidden states, E_s.
    The gain matrix is ``theta`` times the inverse of E_s (see `decoupling_gains`): each sample removes the
    share theta of all errors, and no constraint disturbs another. The reading of an active constraint is
    compared with its limit, free of errors of the response model, that of an inactive one with the model.
    The estimate is clamped to the ranges of the hidden states, without wind-up.

    Parameters
    ----------
    curve : Area
        Optima over several hidden states, from `plan`.
    theta : float
        Share (0, 1] of each error removed per sample.
    start : mapping, optional
        Initial estimate of each hidden state, by name, in its unit. Default: middle of the range.
    margin : mapping, optional
        Distance kept from each limit, by name of the response, in its unit.
    period : float, optional
        Sampling period, s. None: one sample per event of the plant.

    Raises
    ------
    ValueError
        When theta or a state is out of range, or a name is unknown.
    TypeError
        When the curve is not an `Area`.

    Examples
    --------
    >>> from sdpgrind import locus
    >>> area = locus.plan(locus.preset("grinding-roughness"))
    >>> controller = locus.AreaController(area)
    >>> command = controller.step(grinding_power=1400.0, roughness=0.0008)  # W, mm
    >>> sorted(command)
    ['dressing_lead', 'infeed_rate', 'work_rotation']
    """

    _changing = ("state",)
    curve: Area = part(Area, ", as locus.plan gives it for several hidden states")
    _: KW_ONLY
    theta: float = quantity("1", above=0, at_most=1, default=0.5)
    start: Mapping[str, float] | None = custom(default=None)
    margin: Mapping[str, float] = custom(default_factory=dict)
    period: float | None = quantity("s", above=0, default=None)
    state: Floats = field(init=False, repr=False, compare=False)

    def _check(self) -> None:
        for name, value in self.margin.items():
            checks.one_of("margin", name, self.curve.responses)
            checks.nonnegative(f"margin[{name!r}]", value, self.curve.problem.unit(name))
        object.__setattr__(self, "state", self._first())

    def _first(self) -> Floats:
        hidden, system = self.curve.problem.hidden, self.curve.system
        if self.start is None:
            return np.full(system.h, 0.5)
        if set(self.start) != set(hidden):
            raise ValueError(f"start must have {', '.join(hidden)}; got {', '.join(self.start)}")
        values = [checks.within(f"start[{name!r}]", self.start[name], *ends) for name, ends in hidden.items()]
        return system.scaled(np.array(values), system.n)

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
        """Name of each reported hidden state to its unit."""
        return {name: self.curve.problem.unit(name) for name in self.curve.problem.hidden_names}

    @property
    def job(self) -> Mapping[str, object]:
        """Data of the job that plan and machine must share, in their units; empty for a process without."""
        return dict(getattr(self.curve.problem.model, "job", {}))

    def reset(self) -> None:
        """Return to the initial estimate."""
        self.state[:] = self._first()

    @property
    def command(self) -> dict[str, float]:
        """Current controls, in the user's units."""
        return self._best().controls

    def _best(self) -> Point:
        return self.curve.at(**self.report())

    def step(self, **measurement: float) -> dict[str, float]:
        """Return the controls of the next sample, in the user's units.

        Parameters
        ----------
        **measurement : float
            All responses by name, in their units. NaN or infinity: no reading.

        Raises
        ------
        ValueError
            When a response is missing.
        TypeError
            When a response is not a number.
        """
        missing = [name for name in self.curve.responses if name not in measurement]
        if missing:
            raise ValueError(
                f"measurement must have {', '.join(missing)}; got {', '.join(measurement) or 'nothing'}"
            )
        readings = np.array([usable(name, measurement[name]) for name in self.curve.responses])
        error, slopes = self._errors(readings)
        known = np.isfinite(error)
        move = (
            np.linalg.lstsq(slopes[known], error[known], rcond=None)[0]
            if np.any(known)
            else np.zeros(self.state.size)
        )
        self.state[:] = np.clip(self.state + self.theta * move, 0.0, 1.0)
        return self.command

    def _errors(self, readings: Floats) -> tuple[Floats, Floats]:
        """Errors (m,), scaled, and slopes (m, h) of the scaled responses by the scaled hidden states."""
        system, best = self.curve.system, self._best()
        controls, hidden = np.array(list(best.controls.values())), system.unscaled(self.state, system.n)
        out = np.empty((1, system.m * (1 + system.h)))
        run_many(system.response_tape, np.concatenate([controls, hidden])[None], out)
        limit = system.values(controls, hidden)[2] - [
            self.margin.get(name, 0.0) for name in self.curve.responses
        ]
        active = np.array([best.multipliers[name] > 0 for name in self.curve.responses])
        error = (readings - np.where(active, limit, out[0, : system.m])) / system.scales
        slopes = out[0, system.m :].reshape(system.m, system.h) * system.unscaled_slope(self.state, system.n)
        return error, slopes / system.scales[:, None]

    def report(self) -> dict[str, float]:
        """Return the estimated hidden states, in their units."""
        hidden = self.curve.system.unscaled(self.state, self.curve.system.n)
        return dict(zip(self.curve.problem.hidden_names, map(float, hidden), strict=True))
