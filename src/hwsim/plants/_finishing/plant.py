"""A finishing cell: a robot moves a tool over a surface, a torque-controlled axis presses it."""

from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY
from functools import cached_property
from typing import TypeAlias

import numpy as np
from scipy.spatial import cKDTree

from hwsim.plants._finishing.machine import FinishingPart, FinishingSetup
from sdpgrind.base import checks
from sdpgrind.base.quantities import Described, described, part, quantity, valued
from sdpgrind.finishing import FinishingProblem, TorqueAxis
from sdpgrind.finishing.kernels import CellScatter as CellScatter
from sdpgrind.finishing.kernels import CellTruth as CellTruth
from sdpgrind.finishing.kernels import HeightField as HeightField
from sdpgrind.finishing.kernels import check_pressed
from sdpgrind.finishing.path import PathSamples

Truth: TypeAlias = CellTruth | Callable[[np.random.Generator], CellTruth] | None


@described()
class FinishingCell(Described):
    """Robot-assisted finishing of one specimen: Wang and Jan (2001), section 5, with errors they leave out.

    It accepts ``current`` of the torque axis (A; in steps of the converter, clipped), a ``motion`` (array (m,
    n + 1): time in s, n joints in rad or mm; once, before it is played) and ``feed_override`` (0 ... 1 of
    the planned speed). It measures ``motor_angle`` (rad, in counts of the encoder) and ``path_time`` (time of
    the motion played, s).

    The robot follows its joints exactly; its table, if any, has the error of its loop, so that the contact
    leaves the path; the surface is higher than planned by a random field. Both change the contact angle,
    theta_s = -(h - d.n)/(R cos theta_f) for a height h, an error d of the table and a normal n. Curvature
    over d, at most d^2/2 times it, is neglected: 1 µm for 0.2 mm on a radius of 20 mm, 1.3 mN. The axis
    advances exactly over each tick (`sdpgrind.finishing.kernels`), with a contact that only presses and is
    damped by the controller alone. The normal force is F = T_f/(R (cos theta - s mu sin theta cos psi)), at
    the angle theta of the true surface and the direction psi of the true feed; below 0.5 mm/s friction falls
    with the speed. Between rows a motion is linear.

    The tool starts above the surface and the controller lowers it; if the gap is some mm,
    `sdpgrind.finishing.identify` finds the load torque from this free motion. A part ends when its motion is
    played.

    Outcome of a part: ``time`` and ``touch_down`` (s); over the motion mean ``normal_force`` (N) with
    ``normal_force_sd``, ``_min`` and ``_max``, ``force_error`` (N, rms from the target force, if any), the
    share of time without contact ``lift_off``, ``feed`` and ``feed_sd`` of the contact (mm/s; longer than
    planned when the table overshoots); largest ``path_deviation`` (mm, in the surface, across the planned
    direction); ``roughness_ra`` (mm, drawn from the model at the mean force; NaN: unknown pattern),
    ``extrapolated`` (1: outside the model's range), ``timed_out``; the hidden ``true_torque_constant`` (N
    m/A), ``true_contact_angular_stiffness`` (N m/rad), ``true_friction_ratio`` and ``true_load_torque`` (N
    m). At 5000 ticks or fewer: ``sample_time`` (s), ``true_normal_force`` (N, mean of the tick),
    ``true_feed`` (mm/s), ``height_error`` (mm, to be followed by the tool), ``true_x`` and ``true_y`` of the
    contact (mm).

    Parameters
    ----------
    problem : finishing.FinishingProblem
        The job as believed.
    truth : CellTruth or callable, optional
        Truth of the cell, or a function of a Generator that draws it for each part. None:
        `CellTruth.nominal`.
    scatter : CellScatter, optional
        Scatter of parts. None: none, except in roughness and the phase of the encoder.
    axis : finishing.TorqueAxis, optional
        The torque axis as believed; its sample time is the tick (s). None: `TorqueAxis` with the lever arm of
        the problem.
    target_force : float, optional
        Wanted normal force, N, for ``force_error``; a controller of another force is refused. None: unknown.
    gap : float
        Initial distance between tool and planned surface, mm.
    max_time : float, optional
        Time limit for one part, s. Default: twice the duration of the motion plus 60 s.

    Raises
    ------
    ValueError
        When a value is out of range, or a command cannot be carried out.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import finishing
    >>> problem = finishing.preset("nominal")
    >>> motion = finishing.plan(problem)
    >>> controller = finishing.TorqueController(finishing.TorqueAxis(), motion, normal_force=1.11, kind="lqg")
    >>> log = hwsim.run(hwsim.FinishingCell(problem), controller)
    >>> bool(abs(log.outcome.normal_force[0] - 1.11) < 0.02), float(log.outcome.lift_off[0])  # N, 1
    (True, 0.0)
    """

    problem: FinishingProblem = part(FinishingProblem, ' (see finishing.preset("nominal"))')
    _: KW_ONLY
    truth: Truth = part(CellTruth, ", a function of rng, or None", or_function=True, default=None)
    scatter: CellScatter | None = part(CellScatter, " or None", default=None)
    axis: TorqueAxis | None = part(TorqueAxis, " or None", default=None)
    target_force: float | None = quantity("N", above=0, default=None)
    gap: float = quantity("mm", at_least=0, usual=(0.0, 1000.0), typical=0.05, default=0.05)
    max_time: float | None = quantity("s", above=0, default=None)

    def _check(self) -> None:
        check_pressed(self.problem, "contact_angle of the problem")
        lever_arm, wanted = self.torque_axis.lever_arm, self.problem.lever_arm
        if lever_arm != wanted:
            raise checks.refuse("axis.lever_arm", f"that of the problem, {wanted:g}", lever_arm, "mm")

    @property
    def measures(self) -> Mapping[str, str]:
        """Name -> unit of the measurements."""
        return {"motor_angle": "rad", "path_time": "s"}

    @property
    def accepts(self) -> Mapping[str, str]:
        """Name -> unit of the commands; a motion has columns in s, rad and mm."""
        return {"current": "A", "feed_override": "", "motion": ""}

    @property
    def safe(self) -> Mapping[str, float]:
        """Command without torque (A) and feed (unit 1), at any moment."""
        return {"current": 0.0, "feed_override": 0.0}

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Least and greatest value of a command, unit 1."""
        return {"feed_override": (0.0, 1.0)}

    @property
    def tables(self) -> tuple[str, ...]:
        """Names of the commands that are tables (s, rad, mm)."""
        return ("motion",)

    @property
    def outcomes(self) -> Mapping[str, str | tuple[str, str]]:
        """Name -> unit of the outcomes, with the dimension of those by sample."""
        force = {f"normal_force{end}": "N" for end in ("", "_sd", "_min", "_max")}
        force |= {} if self.target_force is None else {"force_error": "N"}
        path = {"lift_off": "", "feed": "mm/s", "feed_sd": "mm/s", "path_deviation": "mm"}
        true = {
            "torque_constant": "N m/A",
            "contact_angular_stiffness": "N m/rad",
            "friction_ratio": "",
            "load_torque": "N m",
        }
        end = {
            "roughness_ra": "mm",
            "extrapolated": "",
            "timed_out": "",
            **{f"true_{name}": unit for name, unit in true.items()},
        }
        place = {"height_error": "mm", "true_x": "mm", "true_y": "mm"}
        samples = {"sample_time": "s", "true_normal_force": "N", "true_feed": "mm/s", **place}
        traced = {name: (unit, "sample") for name, unit in samples.items()}
        return {"time": "s", "touch_down": "s", **force, **path, **end, **traced}

    @property
    def description(self) -> Mapping[str, float | str]:
        """Pattern, feed (mm/s), diameter of the tool (mm), gap (mm) and target force (N), for the log."""
        problem = self.problem
        told = {"feed_rate": problem.feed_rate, "tool_diameter": problem.tool_diameter, "gap": self.gap}
        force = {} if self.target_force is None else {"target_force": self.target_force}
        return {"pattern": problem.path.pattern, "path_length": float(problem.path.length), **told, **force}

    @property
    def job(self) -> Mapping[str, object]:
        """Part and machine of the problem (mm, rad, mm/s), and the force (N); `truth` may differ."""
        force = {} if self.target_force is None else valued(self, ("target_force",))
        return {**self.problem.job, **force}

    @cached_property
    def torque_axis(self) -> TorqueAxis:
        """The torque axis as believed: `axis`, or `TorqueAxis` with the lever arm (mm) of the problem."""
        return TorqueAxis(lever_arm=self.problem.lever_arm) if self.axis is None else self.axis

    @property
    def tick(self) -> float:
        """Sample time of the axis, s."""
        return float(self.torque_axis.sample_time)

    @cached_property
    def tree(self) -> cKDTree:
        """Points on the path, mm; the tip of a motion must stay near them."""
        return cKDTree(self.problem.path.sample().point)

    @cached_property
    def first(self) -> PathSamples:
        """Beginning of the path: point (mm), tangent and normal."""
        return self.problem.path.at(0.0)

    def start(self, rng: np.random.Generator) -> FinishingPart:
        """Draw the truth of the next part from `rng` and return it at time 0 s.

        Truth, scatter and the rest draw from a child each: controllers are compared on equal draws.
        """
        of_truth, of_scatter, of_rest = rng.spawn(3)
        truth = CellTruth.nominal(self.problem, self.torque_axis) if self.truth is None else self.truth
        if not isinstance(truth, CellTruth):
            truth = checks.kind("truth(rng)", truth(of_truth), CellTruth, " (see hwsim.CellTruth)")
        if self.scatter is not None:
            truth = self.scatter.drawn(truth, of_scatter)
        offset = self.torque_axis.angle_step * (float(of_rest.random()) - 0.5)
        return FinishingPart(FinishingSetup(self, truth, offset, float(of_rest.standard_normal())))
