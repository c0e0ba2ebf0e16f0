"""Planner of a pass: heights and forces that leave the target, within the grinder's power."""

from collections.abc import Callable
from functools import cached_property, partial
from typing import Any, Self

import numpy as np
import xarray as xr

from sdpgrind.base import checks, pictures, stored
from sdpgrind.base.checks import Floats
from sdpgrind.base.plans import Plan
from sdpgrind.base.sheets.blocks import AmountTable, figures
from sdpgrind.weldbead.passes import _kernels
from sdpgrind.weldbead.passes._collocation import Collocation, Freedom, collocate
from sdpgrind.weldbead.passes._contour import Contour, volume_between
from sdpgrind.weldbead.passes._disk import TiltedDisc
from sdpgrind.weldbead.passes._problem import PassProblem
from sdpgrind.weldbead.passes._simulate import PassRecord, PassRun, even_bead, simulate

METHODS = ("inverse", "pi", "static", "quasistatic", "collocation")
_MAY_STALL = ("static", "quasistatic")  # derived: the others raise the disc instead
GAINS = (10.0, 2000.0)  # chosen: gains of the method "pi" on the error of the tip, 1 and 1/s
_STEPS = {
    "center_x": ("mm", "position of the disc's center"),
    "tip_x": ("mm", "position of the tip"),
    "tip_z": ("mm", "height of the tip"),
    "fly_height": ("mm", "height of the disc's center"),
    "disk_angle": ("rad", "angle of the disc"),
    "normal_force": ("N", "normal force"),
    "grinding_power": ("W", "power at the contact"),
    "removal_rate": ("mm^3/s", "removal rate"),
    "disk_speed": ("rad/s", "disc speed"),
    "removed": ("mm^3", "volume removed in the step"),
    "patches": ("1", "pieces of bead in contact"),
}


class PassPlan(Plan):
    """Planned pass: heights, forces and what they leave; immutable. Has the attributes of its `PassRecord`.

    Attributes
    ----------
    problem : PassProblem
        Problem that was planned.
    record : PassRecord
        Expected course: time (s), fly_height (mm), normal_force (N), contour (mm), ...
    method : str
        Method of the plan; "inverse" where "collocation" could not be used.
    error : float
        Estimated error of the contour, mm rms. A function that returns it is called when first asked.
    collocation : Collocation or None
        Outcome of the optimal control problem, where it was asked for.
    """

    kind = "weldbead.pass"

    def __init__(
        self,
        problem: PassProblem,
        record: PassRecord,
        method: str,
        error: float | Callable[[], float],
        collocation: Collocation | None = None,
    ) -> None:
        self.problem, self.record, self.method, self._error = problem, record, method, error
        self.collocation = collocation

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or "record" not in self.__dict__:
            raise AttributeError(name)
        return getattr(self.record, name)

    @cached_property
    def error(self) -> float:
        """Estimated error of the contour, mm rms, from a simulation of twice the step.

        With "collocation", that of the inverse plan it starts from.
        """
        return self._error() if callable(self._error) else self._error

    @property
    def shortfall(self) -> float:
        """Volume above the target that the pass leaves, mm^3."""
        return volume_between(self.contour, self.problem.target, self.problem.disc.model.bead_width)

    @property
    def overcut(self) -> float:
        """Volume below the target that the pass removes, mm^3."""
        return volume_between(self.problem.target, self.contour, self.problem.disc.model.bead_width)

    @property
    def face_leaves(self) -> float:
        """Time from which on the face of the disc leaves the bead, s: the contact grows shorter."""
        end, top = self.problem.bead.x[-1], self.problem.bead.z[-1]
        face = np.maximum(top - self.tip_z, 0.0) / np.tan(self.disk_angle)
        return float(self.time[np.searchsorted(np.maximum.accumulate(self.tip_x + face), end)])

    @property
    def burn_margin(self) -> float:
        """Least margin of the normal force to burning, N, each step at its feed; < 0: it burns.

        inf: no burn limit. A lower limit of force is ignored: each cut begins and ends at no force.
        """
        return float(np.min(self._burn_force - self.normal_force[1:]))

    @property
    def _burn_force(self) -> Floats:
        # times are sums: equal feeds differ by rounding
        return self.problem.burn_force(np.round(self.record.feed_rate, 9))

    @property
    def status(self) -> str:
        """One sentence: whether the target is reached, or the obstacle (N, share of the volume)."""
        share = self.shortfall / self.problem.volume if self.problem.volume > 0 else 0.0
        limit = np.minimum(self._burn_force, self.problem.grinder_limit)
        over = self.overcut / max(self.problem.volume, 1e-12)
        worst = float(np.max(self.normal_force[1:] - limit))
        most = int(np.argmin(limit - self.normal_force[1:]))
        if self.burn_margin < -1e-6:
            return f"burns, by up to {-self.burn_margin:.3g} N; leaves {100 * share:.3g} % of the volume"
        if worst > 0.05 * self.problem.force_limit:
            return (
                f"exceeds its limit of {limit[most]:.4g} N by {worst:.3g} N;"
                f" leaves {100 * share:.3g} % of the volume"
            )
        if over > 5e-3:
            return f"cuts too deep, by {100 * over:.3g} % of the volume; leaves {100 * share:.3g} %"
        if self.normal_force[1 + most] >= limit[most] * (1 - 1e-9):
            return f"limited to {limit[most]:.4g} N: {100 * share:.3g} % of the volume is left"
        return "reaches the target" if share < 1e-3 else f"leaves {100 * share:.3g} % of the volume"

    def simulate(self, model: TiltedDisc | None = None) -> PassRecord:
        """Play the planned heights back on another truth.

        Parameters
        ----------
        model : TiltedDisc, optional
            True disc (J/mm^3, W, ...). Default: that of the plan.

        Raises
        ------
        GrinderStalled
            When it lacks the power.
        """
        p = self.problem
        truth = p.disc
        if model is not None:
            truth = checks.kind("model", model, TiltedDisc, ", the disc as it really is")
        return simulate(
            truth, p.bead, center_x=self.center_x, fly_height=self.fly_height,
            feed_rate=self.record.feed_rate, spacing=p.spacing,
        )  # fmt: skip

    def _figures(self) -> tuple[AmountTable]:
        rows = (
            ("time", float(self.time[-1]), "s"),
            ("volume", float(self.problem.volume), "mm^3"),
            ("shortfall", float(self.shortfall), "mm^3"),
            ("overcut", float(self.overcut), "mm^3"),
            ("greatest_force", float(np.max(self.normal_force)), "N"),
            ("burn_margin", float(self.burn_margin), "N"),
            ("error_of_the_contour", float(self.error), "mm"),
            ("method", self.method, ""),
        )
        return (figures("The pass by the model", *rows),)

    def plot(self) -> Any:
        """Draw contours, force, power and height along the bead; return the figure."""
        return pictures.drawn("sdpgrind.weldbead.passes._picture:plot_pass", self)

    @property
    def dataset(self) -> xr.Dataset:
        """The plan with labels and units (dimensions: step, node), and the problem as JSON."""
        steps = {
            k: ("step", getattr(self.record, k), {"units": u, "long_name": n}) for k, (u, n) in _STEPS.items()
        }
        nodes = {
            "contour": (
                "node",
                np.array(self.contour.z),
                {"units": "mm", "long_name": "height after the pass"},
            )
        }
        coordinates = {
            "time": ("step", self.time, {"units": "s", "long_name": "time since the start"}),
            "x": ("node", np.array(self.contour.x), {"units": "mm", "long_name": "position along the bead"}),
        }
        attrs = {"problem": stored.encode(self.problem), "method": self.method, "error": self.error}
        if self.collocation is not None:
            attrs["collocation"] = stored.encode(self.collocation)
        return xr.Dataset(steps | nodes, coordinates, attrs)

    @classmethod
    def restored(cls, dataset: xr.Dataset) -> Self:
        told = dataset.attrs
        problem: PassProblem = stored.decode(told["problem"])
        arrays = {name: dataset[name].values for name in ("time", *_STEPS)}
        after = Contour(dataset["x"].values, dataset["contour"].values)
        record = PassRecord(**arrays, before=problem.bead, contour=after)
        how = stored.decode(told["collocation"]) if "collocation" in told else None
        return cls(problem, record, told["method"], float(told["error"]), how)

    def _told(self) -> str:
        return f"{self.method}, {self.time[-1]:.3g} s, {self.volume:.4g} mm^3, {self.status}"


def plan(
    problem: PassProblem,
    *,
    method: str = "inverse",
    gains: tuple[float, float] = GAINS,
    freedom: Freedom | None = None,
    strict: bool = False,
) -> PassPlan:
    """Plan a pass.

    Parameters
    ----------
    problem : PassProblem
        Problem to plan.
    method : {"inverse", "pi", "static", "quasistatic", "collocation"}
        "inverse": the tip is held on its path, or the force at its limit. "pi": a feedback of the tip's error
        moves the disc, Brown (1988), (6.17). "static": force of a steady cut of the local depth, (8.3.3), and
        the height that gives it. "quasistatic": the same with the depth where the face meets the bead, ahead
        of the tip. "collocation": optimal control where one patch cuts, replayed by the balance of volumes;
        where unusable, the plan is "inverse", and ``collocation.message`` has the reason.
    gains : (float, float)
        Gains of "pi" on the error of the tip and on its integral, 1 and 1/s.
    freedom : Freedom, optional
        With "collocation": free range of the feed (mm/s), and limits on the rates of height and force.
    strict : bool
        Whether a pass that cannot reach the target is an error.

    Returns
    -------
    PassPlan
        Time in s, heights in mm, forces in N.

    Raises
    ------
    ValueError
        With `strict`, when the limits leave more than 0.1 % of the volume.
    GrinderStalled
        When "static" asks for more than the motor has.

    Examples
    --------
    >>> from sdpgrind import units, weldbead
    >>> process = weldbead.GrindingProcess(12.8, 114.0, 0.33, 88.9, 500.0, 0.0, 12.7)
    >>> disc = TiltedDisc(process, relaxed_angle=units.deg(20), rotational_stiffness=6e5)
    >>> bead = Contour([0, 75, 150], [1.0, 1.3, 1.0])
    >>> pass_ = plan(PassProblem(disc, bead, mean_cut=0.2, feed_rate=20.0))
    >>> pass_.status, round(pass_.volume / pass_.problem.volume, 3)
    ('reaches the target', 1.0)
    """
    checks.kind("problem", problem, PassProblem)
    checks.one_of("method", method, METHODS)
    gains = _checked_gains(gains)
    if freedom is not None:
        checks.kind("freedom", freedom, Freedom)
    if freedom is not None and method != "collocation":
        raise ValueError(
            f"freedom must be None with method {method!r}: only 'collocation' chooses the feed (mm/s)"
        )
    record = _record(problem, method, gains, problem.spacing)
    error: Callable[[], float] | float = partial(_error, problem, method, gains, record)
    if method in _MAY_STALL:
        error = _error(problem, method, gains, record)
    planned = PassPlan(problem, record, method, error)
    if method == "collocation":
        found, how = collocate(problem, record, freedom=freedom)
        planned = PassPlan(problem, found or record, method if found else "inverse", error, how)
    if strict and planned.shortfall > 1e-3 * problem.volume:
        raise ValueError(
            "mean_cut must be within the limits of force and power where strict (mm):"
            f" the pass {planned.status}"
        )
    return planned


def _checked_gains(gains: Any) -> tuple[float, float]:
    if np.shape(gains) != (2,):
        raise ValueError(f"gains must be two, on the error (1) and on its integral (1/s); got {gains!r}")
    return checks.nonnegative("gains[0]", gains[0]), checks.positive("gains[1]", gains[1], "1/s")


def _record(problem: PassProblem, method: str, gains: tuple[float, float], spacing: float) -> PassRecord:
    disk, feed, nodes = problem.disc, problem.feed_rate, problem.nodes_at(spacing)
    center = _centers(problem, spacing)
    if method in _MAY_STALL:
        height = _static_height(problem, center, ahead=method == "quasistatic")
        return simulate(
            disk, problem.bead, center_x=center, fly_height=height, feed_rate=feed, spacing=spacing
        )
    ground = even_bead(problem.bead, nodes, disk.model.bead_width)
    angle, times = np.full(center.size, disk.relaxed_angle), np.full(center.size - 1, spacing / feed)
    run = PassRun(disk, ground, center, angle, times, nodes)
    path = problem.tip_path.at(nodes)
    start = np.full(center.size, path[0] + disk.model.disk_radius * np.sin(disk.relaxed_angle))
    most = float(disk.deflection(problem.force_limit * disk.model.disk_radius))
    mode = _kernels.FEEDBACK if method == "pi" else _kernels.INVERSE
    return run.record(problem.bead, run.grind(start, mode, path=path, gains=gains, wind_max=most))


def _error(problem: PassProblem, method: str, gains: tuple[float, float], record: PassRecord) -> float:
    """Return the error of a contour, mm rms, by Richardson's rule, from a simulation of twice the step."""
    coarse = _record(problem, method, gains, 2 * problem.spacing)
    x = np.array(coarse.contour.x)
    return float(np.sqrt(np.mean((record.contour.at(x) - np.array(coarse.contour.z)) ** 2))) / 3


def _centers(problem: PassProblem, spacing: float) -> Floats:
    """Positions of the centre, mm, from the lead-in until the tip has left the bead at any wind-up."""
    disk = problem.disc
    reach = disk.model.disk_radius * np.cos(disk.relaxed_angle)
    most = float(disk.deflection(problem.force_limit * disk.model.disk_radius))
    lag = disk.model.disk_radius * np.cos(max(0.0, disk.relaxed_angle - most)) - reach
    begin, end = problem.bead.x[0] - problem.lead_in + reach, problem.bead.x[-1] + reach + lag
    return np.asarray(begin + spacing * np.arange(int(np.ceil((end - begin) / spacing)) + 2))


def _static_height(problem: PassProblem, center: Floats, *, ahead: bool) -> Floats:
    """Heights, mm, for the force of a steady cut of the local depth; Brown (1988), 8.3.3.

    `ahead`: the depth is that at the front of the face; at a constant angle the face sweeps feed times width
    times the height of its front above the tip.
    """
    disk, radius, bead = problem.disc, problem.disc.model.disk_radius, problem.bead
    angle, front = np.full(center.size, disk.relaxed_angle), np.zeros(center.size)
    for _ in range(60):  # a contraction: tip and front follow angle and depth
        x = center - radius * np.cos(angle)
        at = x + front
        depth = np.where((at >= bead.x[0]) & (at <= bead.x[-1]), bead.at(at) - problem.tip_path.at(x), 0.0)
        if ahead:
            front = 0.5 * (front + np.maximum(depth, 0.0) / np.tan(angle))
        force = np.where(depth > 0, disk.model.normal_force(np.maximum(depth, 1e-12), problem.feed_rate), 0.0)
        angle = disk.relaxed_angle - disk.deflection(np.minimum(force, problem.force_limit) * radius)
    return np.asarray(problem.tip_path.at(center - radius * np.cos(angle)) + radius * np.sin(angle))
