"""Step, state and report of a controller on an area."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import exp, isclose, isfinite, nan
from typing import Any

import numpy as np
from scipy.linalg import null_space

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.base.controllers import Stateful
from sdpgrind.locus._control.area_start import hidden_at, start_place
from sdpgrind.locus._control.readings import counted, settled, usable
from sdpgrind.locus._curve.area import Area
from sdpgrind.locus._curve.changed import fixed, tightened
from sdpgrind.locus._curve.point import Point
from sdpgrind.locus._path.walk_kernels import PATIENCE
from sdpgrind.locus._problem.tape_kernels import run_many

ROUNDING = 1e-9  # chosen: scaled; a smaller step beyond an end of a range, or for a state, is none


@dataclass
class AreaCourse:
    """What changes during a part beside the estimate.

    `area` has the optima over the controls that are free in this part, at the margins from the limits; `held`
    has the others. `slack` (m,) is that of the last reading of each response, to the limit itself. `beyond`
    (h,) is -1 or 1 where a hidden state beyond the least or greatest of its range explains the last reading,
    `asked` the number of such readings in a row.
    """

    area: Area
    held: dict[str, float]
    actual: Floats
    slack: Floats
    beyond: Floats
    asked: Floats
    samples: float = 0.0
    waited: float = 0.0
    best: Point | None = None


class AreaWalking(Stateful):
    """State and step of a controller; its parameters are fields of the subclass."""

    _changing = ("state", "_course")
    curve: Area
    theta: float
    start: Any
    hold: str | float
    lag: Mapping[str, float]
    period: float | None
    per_part: tuple[str, ...]
    state: Floats

    @property
    def margins(self) -> Mapping[str, float]:
        """Distance kept from each limit, by name of the response, in its unit."""
        raise AttributeError

    @cached_property
    def start_state(self) -> Floats:
        """Scaled hidden states (h,) of the start, unit 1."""
        return start_place(self._kept, self.start)

    @property
    def _kept(self) -> Area:
        """Optima at the margins from the limits."""
        return tightened(self.curve, tuple(self.margins.items()))

    @property
    def hidden(self) -> dict[str, float]:
        """Estimated hidden states by name, in their units."""
        return hidden_at(self.curve, self.state)

    def reset(self) -> None:
        """Return to the start; a learned start is kept."""
        if self.start != "learned":
            self.state[:] = self.start_state
        self.__dict__.pop("_course", None)

    @cached_property
    def _course(self) -> AreaCourse:
        return self._begun({})

    def _begun(self, measured: Mapping[str, float]) -> AreaCourse:
        """Return the course of a part that begins, with `measured` values of controls held in it."""
        area, held, many = self._kept, dict[str, float](), len(self.curve.responses)
        if self.per_part:
            best = area.at(**self.hidden).controls
            held = {name: measured.get(name, best[name]) for name in self.per_part}
            area = fixed(area, held)
        counts = np.zeros((2, len(self.state)))
        course = AreaCourse(area, held, np.empty(0), np.full(many, nan), *counts)
        self.__dict__["_course"] = course
        course.actual = np.where(self._decay > 0, 0.0, self._commanded)
        return course

    def _begin_with(self, measurement: Mapping[str, Any]) -> AreaCourse:
        """Return the course with the measured values of held controls; it begins anew where they changed."""
        values = {name: usable(name, measurement.get(name, nan)) for name in self.per_part}
        measured = {name: value for name, value in values.items() if isfinite(value)}
        known: AreaCourse | None = self.__dict__.get("_course")
        if known is None or not all(
            isclose(known.held[name], value, rel_tol=ROUNDING) for name, value in measured.items()
        ):
            return self._begun(measured)
        return known

    @property
    def _decay(self) -> Floats:
        """Decay (n,) of command less actual control per period; 0: no lag."""
        lags = [self.lag.get(name, 0.0) for name in self._course.area.names]
        return np.array([exp(-self.period / lag) if lag and self.period else 0.0 for lag in lags])

    @property
    def command(self) -> dict[str, float]:
        """Current controls, in the user's units."""
        known = {**self._best().controls, **self._course.held}
        return {name: known[name] for name in self.curve.names}

    @property
    def _commanded(self) -> Floats:
        """Controls that are free in this part (n,)."""
        best = self._best().controls
        return np.array([best[name] for name in self._course.area.names])

    def _best(self) -> Point:
        """Return the optimum for the estimate; with nothing feasible at the held controls, without them."""
        course = self._course
        if course.best is None:
            try:
                course.best = course.area.at(**self.hidden)
            except ValueError:
                if not course.held:
                    raise
                course.best = self._kept.at(**self.hidden)
        return course.best

    def step(self, **measurement: float) -> dict[str, float]:
        """Return the controls of the next sample, in the user's units.

        Parameters
        ----------
        **measurement : float
            All responses by name, in their units (NaN or infinity: no reading); controls, where measured.

        Raises
        ------
        ValueError
            When a response is missing.
        TypeError
            When a value is not a number.
        """
        missing = [name for name in self.curve.responses if name not in measurement]
        if missing:
            raise ValueError(
                f"measurement must have {', '.join(missing)}; got {', '.join(measurement) or 'nothing'}"
            )
        readings = np.array([usable(name, measurement[name]) for name in self.curve.responses])
        course = self._begin_with(measurement)
        actual = self._actual(course, measurement)
        if self._counts(course, actual):
            reached = self._move(course, readings, actual)
            for text in self._exhausted(course, reached):
                warnings.warn(text, stacklevel=2)
        return self.command

    def _actual(self, course: AreaCourse, measurement: Mapping[str, Any]) -> Floats:
        """Return the free controls (n,) as they act: measured, estimated by their lags, or commanded."""
        command = self._commanded
        if course.samples:
            course.actual = command + self._decay * (course.actual - command)
        course.samples += 1.0
        measured = np.array([usable(name, measurement.get(name, nan)) for name in course.area.names])
        return np.where(np.isfinite(measured), measured, course.actual)

    def _counts(self, course: AreaCourse, actual: Floats) -> bool:
        """Return whether the law uses this reading; see `hold`."""
        near = all(map(settled, actual, self._commanded))
        counts = counted(self.hold, self.period, course.samples, course.waited, near)
        course.waited = 0.0 if counts else course.waited + 1.0
        return counts

    def _move(self, course: AreaCourse, readings: Floats, actual: Floats) -> Bools:
        """Remove the share theta of the errors; the estimate is clamped to the range, without wind-up.

        Return for which hidden states (h,) patience ends with these readings.
        """
        expected, limit, slopes = self._expected(course, actual)
        error = (readings - expected) / course.area.system.scales
        known = np.isfinite(error) & np.isfinite(slopes).all(axis=1)
        move = moved(slopes, error, known)
        reached = self._count(course, move)
        self.state[:] = np.clip(self.state + self.theta * move, 0.0, 1.0)
        course.best = None
        margins = [self.margins.get(name, 0.0) for name in self.curve.responses]
        course.slack = np.where(known, limit + margins - readings, course.slack)
        return reached

    def _expected(self, course: AreaCourse, actual: Floats) -> tuple[Floats, Floats, Floats]:
        """Expected readings and limits (m,) at the actual controls, slopes (m, h) by the scaled states.

        An active constraint is expected at its limit, free of errors of the response model, an inactive one
        where the model has it. By what the actual controls are away from their commands, the model tells.
        """
        system, best, command = course.area.system, self._best(), self._commanded
        hidden = np.array(list(self.hidden.values()))
        rows = np.array([np.concatenate([each, hidden]) for each in (command, actual)])
        out = np.empty((2, system.m * (1 + system.h)))
        run_many(system.response_tape, rows, out)
        of_command, of_actual = out[:, : system.m]
        active = np.array([best.multipliers[name] > 0 for name in self.curve.responses])
        limits = system.values(np.array([command, actual]), hidden)[2]
        expected = np.where(active, limits[0], of_command) + (of_actual - of_command)
        slopes = out[1, system.m :].reshape(system.m, system.h) * system.unscaled_slope(self.state, system.n)
        return expected, limits[1], slopes / system.scales[:, None]

    def _count(self, course: AreaCourse, move: Floats) -> Bools:
        """Count the readings in a row that a state beyond its range explains; return where patience ends."""
        told, explained = np.abs(move) > ROUNDING, self.state + move
        beyond = np.where(explained > 1 + ROUNDING, 1.0, np.where(explained < -ROUNDING, -1.0, 0.0))
        asked = np.where(beyond != 0, course.asked + 1.0, 0.0)
        course.asked = np.where(told, asked, course.asked)
        course.beyond = np.where(told, beyond, course.beyond)
        return np.asarray(told & (course.asked == PATIENCE))

    def _exhausted(self, course: AreaCourse, reached: Bools) -> list[str]:
        """Return the texts of warnings about hidden states beyond their ranges."""
        problem = self.curve.problem
        over = [
            f"{name} is over its limit by {-slack:.3g} {problem.unit(name)}".rstrip()
            for name, slack in zip(self.curve.responses, course.slack, strict=True)
            if slack < 0
        ]
        now = ", and ".join(over) or "no limit is exceeded"
        return [
            f"{PATIENCE} readings in a row are explained by a {name} beyond its range,"
            f" {problem.hidden[name][0]:g} to {problem.hidden[name][1]:g} (estimate {value:.6g}); now {now}:"
            f" plan the area for a wider range of {name}"
            for (name, value), told in zip(self.hidden.items(), reached, strict=True)
            if told
        ]

    def report(self) -> dict[str, float]:
        """Return the estimated hidden states and the last slack of each response, in their units.

        ``saturated`` is 1 when a hidden state beyond its range explains its last reading, else 0.
        """
        slacks = dict(zip(self.curve.responses, map(float, self._course.slack), strict=True))
        saturated = float(np.any(self._course.beyond != 0))
        return {
            **self.hidden,
            **{f"{name}_slack": slack for name, slack in slacks.items()},
            "saturated": saturated,
        }


def moved(slopes: Floats, error: Floats, known: Bools) -> Floats:
    """Return the move (h,) of the scaled hidden states that explains the known errors (m,).

    Where these leave directions open, the other responses are kept as the model has them: a response that is
    read seldom is not disturbed in between.
    """
    if not known.any():
        return np.zeros(slopes.shape[1])
    move, _, rank, _ = np.linalg.lstsq(slopes[known], error[known], rcond=None)
    if rank < len(move):
        open_ = null_space(slopes[known])
        others = np.where(np.isfinite(slopes[~known]), slopes[~known], 0.0)
        move = move - open_ @ np.linalg.lstsq(others @ open_, others @ move, rcond=None)[0]
    return np.asarray(move)
