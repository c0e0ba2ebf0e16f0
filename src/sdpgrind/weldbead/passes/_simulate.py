"""Simulation of a pass for given heights of the disc's centre, step by step."""

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt

from sdpgrind import physics
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.weldbead.passes import _kernels, _polyline_kernels
from sdpgrind.weldbead.passes._contour import Contour
from sdpgrind.weldbead.passes._disk import STEEPEST, GrinderStalled, TiltedDisc
from sdpgrind.weldbead.passes._kernels import Bead, Step


@dataclasses.dataclass(frozen=True, eq=False)
class PassRecord:
    """Course of a pass; equations of Brown (1988).

    Attributes
    ----------
    time : array (steps,)
        Time since the start, s.
    center_x, tip_x, tip_z : array (steps,)
        Positions of the disc's centre and of its tip along the bead, and height of the tip, mm.
    fly_height : array (steps,)
        Height of the centre H, mm.
    disk_angle : array (steps,)
        Angle of the disc theta, rad.
    normal_force : array (steps,)
        Torque of the spring over the disc radius, N; (6.9).
    grinding_power : array (steps,)
        Power at the contact, W; (6.11).
    removal_rate : array (steps,)
        Removal rate Q, mm^3/s; (6.13).
    disk_speed : array (steps,)
        Disc speed, rad/s; (4.8).
    removed : array (steps,)
        Volume removed in each step, mm^3.
    patches : array (steps,)
        Pieces of bead in contact; 0: free.
    before, contour : Contour
        Bead before and after, mm.
    """

    time: Floats
    center_x: Floats
    tip_x: Floats
    tip_z: Floats
    fly_height: Floats
    disk_angle: Floats
    normal_force: Floats
    grinding_power: Floats
    removal_rate: Floats
    disk_speed: Floats
    removed: Floats
    patches: Floats
    before: Contour
    contour: Contour

    @property
    def volume(self) -> float:
        """Volume removed, mm^3."""
        return float(np.sum(self.removed))

    @property
    def feed_rate(self) -> Floats:
        """Feed from each step to the next, mm/s, (steps - 1,)."""
        return np.asarray(np.diff(self.center_x) / np.diff(self.time))


def even_bead(contour: Contour, nodes: Floats, width: float | Contour) -> Bead:
    """Return a bead on even nodes for the kernels; its heights are a copy."""
    z = contour.at(nodes)
    spacing = float((nodes[-1] - nodes[0]) / (nodes.size - 1))
    area = spacing * (width.at(nodes) if isinstance(width, Contour) else np.full(nodes.size, width))
    area[[0, -1]] *= 0.5
    return Bead(float(nodes[0]), spacing, z, area, np.maximum.accumulate(z[::-1])[::-1].copy())


def simulate(
    disc: TiltedDisc,
    bead: Contour,
    *,
    center_x: npt.ArrayLike,
    fly_height: npt.ArrayLike,
    feed_rate: npt.ArrayLike,
    relaxed_angle: npt.ArrayLike | None = None,
    spacing: float | None = None,
    width: Contour | None = None,
    order: int = 2,
    exact: bool = False,
) -> PassRecord:
    """Move the disc over a bead at given heights, and cut by balance of volumes; Brown (1988), 6.4.

    Parameters
    ----------
    disc : TiltedDisc
        Disc.
    bead : Contour
        Bead, mm.
    center_x : array (steps + 1,)
        Positions of the centre, rising, mm; at the first the disc must touch nothing.
    fly_height : array (steps + 1,)
        Heights of the centre there, mm.
    feed_rate : float or array (steps,)
        Feed from each position to the next, mm/s.
    relaxed_angle : array (steps + 1,), optional
        Angle of the unloaded disc at each position, rad, where tilt is controlled. Default: that of `disc`.
    spacing : float, optional
        Node distance on the bead, mm. Default: the mean distance of positions.
    width : Contour, optional
        Varying width of the bead, mm. Default: that of the process.
    order : {2, 1}
        Balance by the trapezoid rule, or by backward Euler.
    exact : bool
        Clip the bead as a polyline whose crossings with the disc become points (mm), instead of at even
        nodes: slower, without error but that of the steps. Without wear, and of one width.

    Raises
    ------
    GrinderStalled
        When the motor lacks the power to let the disc pass.
    ValueError
        When lengths differ, or the disc starts in the bead.

    Examples
    --------
    >>> from sdpgrind import units, weldbead
    >>> process = weldbead.GrindingProcess(12.8, 114.0, 0.33, 88.9, 500.0, 0.0, 12.7)
    >>> disc = TiltedDisc(process, relaxed_angle=units.deg(20), rotational_stiffness=6e5)
    >>> x = np.arange(80.0, 140.0, 0.05)
    >>> bead, height = Contour([0, 50], [1, 1]), np.full(x.size, 31.0)
    >>> record = simulate(disc, bead, center_x=x, fly_height=height, feed_rate=20.0)
    >>> 0 < record.volume < 12.7 * 50
    True
    """
    checks.kind("disc", disc, TiltedDisc)
    checks.kind("bead", bead, Contour)
    x, height = (
        checks.finite_array("center_x", center_x, "mm"),
        checks.finite_array("fly_height", fly_height, "mm"),
    )
    if x.ndim != 1 or x.size < 2 or height.shape != x.shape:
        raise ValueError(
            "center_x and fly_height must be of one length, 2 at least (mm);"
            f" got shapes {x.shape}, {height.shape}"
        )
    times = _times(x, feed_rate)
    angle = np.full(x.size, disc.relaxed_angle) if relaxed_angle is None else _angles(x, relaxed_angle)
    if order not in (1, 2):
        raise ValueError(f"order must be 1 or 2; got {order!r}")
    if width is not None and min(width.z) <= 0:
        raise checks.refuse("width", "> 0", float(min(width.z)), "mm")
    step = float(x[-1] - x[0]) / (x.size - 1)
    nodes = _nodes(bead, checks.positive("spacing", spacing, "mm") if spacing is not None else step)
    if exact:
        return _exactly(disc, bead, (x, height, angle, times), width, order)
    ground = even_bead(bead, nodes, width if width is not None else disc.model.bead_width)
    run = PassRun(disc, ground, x, angle, times, nodes)
    return run.record(bead, run.grind(height, _kernels.GIVEN, order=order))


def _exactly(
    disk: TiltedDisc, bead: Contour, way: tuple[Floats, ...], width: Contour | None, order: int
) -> PassRecord:
    """Simulate the pass with the bead clipped as a polyline."""
    if width is not None or np.isfinite(disk.grinding_ratio):
        raise ValueError("exact must be False where the width varies (mm), or the disc wears")
    center, _, angle, times = way
    room = np.empty((2, len(bead.x) + 4 * center.size + 8))
    room[:, : len(bead.x)] = bead.x, bead.z
    out = np.empty((center.size, 9))
    code, done, size = _polyline_kernels.grind(
        *room, len(bead.x), disk.model.bead_width, disk.core, *way, order == 2, out
    )
    if code == _kernels.OVERLAPPING:
        raise ValueError(f"the disc must start clear of the bead (mm); its center starts at {center[0]:.5g}")
    run = PassRun(
        disk, Bead(0.0, 1.0, room[1, :size], room[1, :0], room[1, :0]), center, angle, times, room[0, :size]
    )
    if code == _kernels.STALLED:
        raise run.stalled(done - 1, float(out[done - 1, 3]))
    return run.record(bead, out)


def _angles(x: Floats, relaxed_angle: npt.ArrayLike) -> Floats:
    """Return one relaxed angle, rad, for each position."""
    angle = checks.finite_array("relaxed_angle", relaxed_angle, "rad")
    if angle.shape != x.shape:
        raise ValueError(
            f"relaxed_angle must have one entry for each position, {x.size} (rad); got shape {angle.shape}"
        )
    if np.any((angle <= 0) | (angle > STEEPEST)):
        raise checks.refuse(
            "relaxed_angle",
            f"in (0, {STEEPEST:g}]",
            float(angle[(angle <= 0) | (angle > STEEPEST)][0]),
            "rad",
        )
    return angle


def _times(x: Floats, feed_rate: npt.ArrayLike) -> Floats:
    """Return the time, s, from each position to the next."""
    feed = checks.finite_array("feed_rate", feed_rate, "mm/s")
    if feed.shape not in ((), (x.size - 1,)):
        raise ValueError(
            f"feed_rate must be a number or have one entry for each step, {x.size - 1} (mm/s);"
            f" got {feed.shape}"
        )
    if np.any(feed <= 0):
        raise checks.refuse("feed_rate", "> 0", float(feed.min()), "mm/s")
    if np.any(np.diff(x) <= 0):
        raise checks.refuse("center_x", "rising", float(x[1:][np.diff(x) <= 0][0]), "mm")
    return np.asarray(np.diff(x) / feed)


def _nodes(bead: Contour, spacing: float) -> Floats:
    return np.linspace(bead.x[0], bead.x[-1], max(2, round(bead.length / spacing)) + 1)


@dataclasses.dataclass
class PassRun:
    """Disc over a bead on even nodes, at positions of its centre with the times between them; used once."""

    disk: TiltedDisc
    ground: Bead
    center_x: Floats
    relaxed_angle: Floats
    times: Floats
    nodes: Floats

    def grind(
        self,
        height: Floats,
        mode: int,
        *,
        path: Floats | None = None,
        gains: tuple[float, float] = (0.0, 0.0),
        wind_max: float = np.inf,
        order: int = 2,
    ) -> Floats:
        """Run the kernel; heights are those of all positions (`GIVEN`) or start with that of the first."""
        core, x = self.disk.core, self.center_x
        along = self.nodes * 0.0 if path is None else path
        state, begin = (
            np.zeros(_kernels.STATES),
            Step(x[0], height[0], 0.0, self.relaxed_angle[0], 0.0, self.times[0]),
        )
        if mode == _kernels.INVERSE:
            begin = begin._replace(a=0.0, b=1.0)
        place = _kernels.tip(0.0, begin, core, state, along, self.ground)
        state[_kernels.TIP_X], state[_kernels.TIP_Z] = place[0], place[1]
        if _kernels.swept(self.ground, state, begin, 0.0, place[0], place[1]) > 0.0:
            raise ValueError(
                f"the disc must start clear of the bead (mm); its tip starts in metal at {place[0]:.5g}"
            )
        out = np.empty((x.size, 9))
        out[0] = 0.0, 0.0, place[2], place[0], place[1], 0.0, 0.0, 0.0, 0.0
        code, done = _kernels.grind(
            self.ground, core, state, x[1:],
            height[1:] if mode == _kernels.GIVEN else np.full(x.size - 1, place[2]),
            self.relaxed_angle[1:], self.times, along, mode, np.array(gains), min(wind_max, core.wind_max),
            order == 2, out[1:],
        )  # fmt: skip
        if code != _kernels.DONE:
            raise self.stalled(done, float(state[_kernels.TIP_X]))
        return out

    def stalled(self, step: int, tip_x: float) -> GrinderStalled:
        """Return the error of a motor that lacks the power for a step."""
        power = self._power(float(self.disk.spring_torque(self.disk.core.wind_max)))
        return GrinderStalled(float(np.sum(self.times[: step + 1])), tip_x, power)

    def _power(self, torque: Any) -> Any:
        m = self.disk.model
        return physics.disk_power(m.friction_ratio * torque, m.free_speed, m.speed_droop)

    def record(self, before: Contour, out: Floats) -> PassRecord:
        """Return the output of the kernel by name."""
        m = self.disk.model
        wind, torque, height, tip_x, tip_z, rate, removed, patches, _ = out.T.copy()
        return PassRecord(
            time=np.concatenate([[0.0], np.cumsum(self.times)]),
            center_x=self.center_x,
            tip_x=tip_x,
            tip_z=tip_z,
            fly_height=height,
            disk_angle=self.relaxed_angle - wind,
            normal_force=torque / m.disk_radius,
            grinding_power=self._power(torque),
            removal_rate=rate,
            disk_speed=m.free_speed - m.speed_droop * m.friction_ratio * torque,
            removed=removed,
            patches=patches,
            before=before,
            contour=Contour(self.nodes, self.ground.z),
        )
