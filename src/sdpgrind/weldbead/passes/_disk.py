"""Tilted disc on a rotational spring; Brown (1988), 6.4."""

from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, custom, described, part, quantity, valued
from sdpgrind.base.units import N_MM_S_PER_W
from sdpgrind.weldbead.passes._kernels import CutCore
from sdpgrind.weldbead.sequence._process import ENERGIES, GrindingProcess, refuse_other_energy

STEEPEST = 1.3  # chosen: rad; a relaxed angle above it is most likely in degrees
FLATTEST = 0.02  # chosen: rad; least angle of the disc under load


class GrinderStalled(RuntimeError):  # noqa: N818 the field's own word
    """The cut needs more power than the motor has, or than the spring can be wound to.

    Attributes
    ----------
    time, position, power : float
        Time of the stall, s, position of the tip, mm, and greatest power there, W.
    """

    def __init__(self, time: float, position: float, power: float) -> None:
        super().__init__(
            f"the grinder stalls at {time:.4g} s, tip at {position:.5g} mm: the cut needs more than the"
            f" {power:.4g} W that motor and spring give"
        )
        self.time, self.position, self.power = time, position, power


class Linearized(NamedTuple):
    """Steady flat cut, linearised about its depth.

    Attributes
    ----------
    pole : float
        Pole of the process, rad/s.
    static_stiffness, contact_stiffness : float
        Force per platform height, N/mm, for motions slow and fast against the pole.
    disk_angle, normal_force : float
        Point of linearisation: angle, rad, and force, N.
    """

    pole: float
    static_stiffness: float
    contact_stiffness: float
    disk_angle: float
    normal_force: float


def _checked_table(name: str, table: Any) -> tuple[tuple[float, float], ...]:
    """Return the wind-ups, rad, and torques, N mm, of a spring as plain pairs."""
    rows = checks.finite_array(name, table, "rad, N mm")
    if rows.ndim != 2 or rows.shape[0] < 2 or rows.shape[1] != 2:
        raise ValueError(
            "compliance must be pairs of wind-up and torque (rad, N mm), two at least;"
            f" got shape {rows.shape}"
        )
    if np.any(rows[0] != 0):
        raise ValueError(
            f"compliance must begin at no wind-up and no torque (rad, N mm); got {tuple(rows[0].tolist())}"
        )
    if np.any(np.diff(rows, axis=0) <= 0):
        k = int(np.argmax(np.any(np.diff(rows, axis=0) <= 0, axis=1)))
        raise ValueError(
            "compliance must increase in both columns (rad, N mm);"
            f" got {rows[k].tolist()}, {rows[k + 1].tolist()}"
        )
    return tuple((float(a), float(t)) for a, t in rows)


@described("weldbead.tilted_disc")
class TiltedDisc(Described):
    """Rigid disc held at an angle by a rotational spring, cutting with its face; Brown (1988), 6.4.

    Parameters
    ----------
    model : GrindingProcess
        Process of the sequence; ``replace`` takes its fields too.
    relaxed_angle : float
        Angle theta0 of the unloaded disc to the work, rad.
    rotational_stiffness : float
        Stiffness K_theta of the spring, N mm/rad; or give `compliance`.
    compliance : sequence of (float, float), optional
        Wind-up (rad) and torque (N mm) of a nonlinear spring: from (0, 0) on, both increasing.
    stall_guard : float
        Usable share of the motor's greatest power (droop > 0), unit 1.
    grinding_ratio : float
        Volume G ground per volume of disc worn, unit 1; inf: no wear.

    Raises
    ------
    ValueError
        When an angle is not in (0, 1.3], a stiffness is not positive, the table does not increase, or the
        grinder lacks the power to cut at all.

    Examples
    --------
    >>> from sdpgrind import units, weldbead
    >>> process = weldbead.GrindingProcess(12.8, 114.0, 0.33, 88.9, 500.0, 0.0, 12.7)
    >>> disc = TiltedDisc(process, relaxed_angle=units.deg(20), rotational_stiffness=6e5)
    >>> round(disc.contact_stiffness, 2), disc.replace(specific_energy=14.0).model.specific_energy
    (75.92, 14.0)
    """

    model: GrindingProcess = part(GrindingProcess)
    relaxed_angle: float = quantity("rad")
    rotational_stiffness: float | None = quantity("N mm/rad", above=0, default=None)
    compliance: tuple[tuple[float, float], ...] | None = custom(_checked_table, default=None)
    stall_guard: float = quantity("1", at_least=0, at_most=1, default=0.8)
    grinding_ratio: float = quantity("1", above=0, default=np.inf)

    def _check(self) -> None:
        angle = self.relaxed_angle
        if not 0 < angle <= STEEPEST:
            hint = "; units.deg(20) for degrees" if angle > STEEPEST else ""
            raise ValueError(f"relaxed_angle must be in (0, {STEEPEST:g}] (rad){hint}; got {angle!r}")
        if self.model.specific_energy > ENERGIES[1]:  # a low one may be estimated
            refuse_other_energy(self.model)
        if (self.rotational_stiffness is None) == (self.compliance is None):
            raise ValueError("either rotational_stiffness (N mm/rad) or compliance must be given")
        if self.power_max < self.model.idle_power:
            raise ValueError(
                f"idle_power must be below the {self.power_max:.4g} W that the grinder may use, or it cannot"
                f" cut at all (W); got {self.model.idle_power:g}"
            )

    def spring_torque(self, deflection: Any) -> Floats:
        """Return the torque, N mm, of the spring at a wind-up `deflection`, rad; Brown (6.8)."""
        angles, torques = self._table
        end = (torques[-1] - torques[-2]) / (angles[-1] - angles[-2])
        over = np.maximum(np.asarray(deflection, dtype=float) - angles[-1], 0.0)
        return np.asarray(np.interp(deflection, angles, torques) + end * over)

    def deflection(self, torque: Any) -> Floats:
        """Return the wind-up, rad, at a torque, N mm."""
        angles, torques = self._table
        end = (angles[-1] - angles[-2]) / (torques[-1] - torques[-2])
        over = np.maximum(np.asarray(torque, dtype=float) - torques[-1], 0.0)
        return np.asarray(np.interp(torque, torques, angles) + end * over)

    @property
    def _table(self) -> tuple[Floats, Floats]:
        if self.rotational_stiffness is not None:
            return np.array([0.0, 1.0]), np.array([0.0, self.rotational_stiffness])
        angles, torques = np.array(self.compliance).T.copy()  # columns, as kernels are compiled for
        return angles, torques

    @property
    def job(self) -> dict[str, tuple[float, str] | object]:
        """Values that controller and machine must share: angle (rad) and compliance (N mm/rad)."""
        told = valued(self, ("relaxed_angle", "rotational_stiffness"))
        spring = self.compliance if self.rotational_stiffness is None else told["rotational_stiffness"]
        return {"relaxed_angle": told["relaxed_angle"], "compliance": spring}

    @property
    def contact_stiffness(self) -> float:
        """Nominal stiffness against the platform K_theta/R^2, N/mm; see erratum E10."""
        angles, torques = self._table
        return float(torques[1] / angles[1] / self.model.disk_radius**2)

    @property
    def peak_torque(self) -> float:
        """Spring torque of greatest motor power, N mm; inf without droop."""
        droop = self.model.speed_droop
        return self.model.free_speed / (2 * droop * self.model.friction_ratio) if droop > 0 else np.inf

    @property
    def peak_power(self) -> float:
        """Greatest power of the motor, omega0^2/(4000 beta), W; inf without droop."""
        return (
            self.model.free_speed**2 / (4000 * self.model.speed_droop)
            if self.model.speed_droop > 0
            else np.inf
        )

    @property
    def guarded_torque(self) -> float:
        """Torque below the peak at which the power is the share `stall_guard` of the greatest, N mm."""
        return (
            self.peak_torque * (1 - np.sqrt(1 - self.stall_guard)) if self.model.speed_droop > 0 else np.inf
        )

    @property
    def power_max(self) -> float:
        """Power available to a plan, W."""
        return self.stall_guard * self.peak_power

    @property
    def guarded_force(self) -> float:
        """Normal force at the stall guard, N."""
        return self.guarded_torque / self.model.disk_radius

    @property
    def guarded_speed(self) -> float:
        """Disc speed at the stall guard, rad/s."""
        if self.model.speed_droop == 0:
            return self.model.free_speed
        return (
            self.model.free_speed - self.model.speed_droop * self.model.friction_ratio * self.guarded_torque
        )

    def linearize(self, mean_cut: float, feed_rate: float) -> Linearized:
        """Linearise a steady flat cut of depth `mean_cut` d, mm, at a `feed_rate` V, mm/s.

        With D = w V R cos(theta) + dQ/dphi, E = (w d/sin(theta)) (R - l/2) and l = d/sin(theta), the pole is
        D/E, and F/X = (K/R) w (V + d cot(theta) s)/(D + E s).

        Examples
        --------
        >>> from sdpgrind import units, weldbead
        >>> process = weldbead.GrindingProcess(10.0, 100.0, 0.3, 85.0, 500.0, 0.0, 12.5)
        >>> disc = TiltedDisc(process, relaxed_angle=units.deg(20), rotational_stiffness=6e5)
        >>> linear = disc.linearize(mean_cut=0.4, feed_rate=20.0)
        >>> round(float(linear.pole / units.hz(1.0)), 1)
        3.6
        """
        depth, feed = (
            checks.positive("mean_cut", mean_cut, "mm"),
            checks.positive("feed_rate", feed_rate, "mm/s"),
        )
        m, radius, width = self.model, self.model.disk_radius, self.model.bead_width
        force = float(m.normal_force(depth, feed))
        if not np.isfinite(force):
            raise checks.refuse("mean_cut", "within the power of the grinder at this feed", mean_cut, "mm")
        torque = force * radius
        wind = float(self.deflection(torque))
        if not wind < self.core.wind_max:
            raise checks.refuse(
                "mean_cut",
                f"less: {force:.4g} N wind the spring beyond what the disc can lean back",
                depth,
                "mm",
            )
        angle = self.relaxed_angle - wind
        stiffness = float(self.spring_torque(wind + 1e-7) - self.spring_torque(wind - 1e-7)) / 2e-7
        mu, droop = m.friction_ratio, m.speed_droop
        rate = mu * (m.free_speed - 2 * droop * mu * torque) * stiffness / (N_MM_S_PER_W * m.specific_energy)
        patch = depth / np.sin(angle)
        d = width * feed * radius * np.cos(angle) + rate
        e = width * patch * (radius - patch / 2)
        per = stiffness / radius * width
        return Linearized(d / e, per * feed / d, per * depth / np.tan(angle) / e, angle, force)

    @property
    def core(self) -> CutCore:
        """The disc for the compiled kernels, in mm, N, rad and s."""
        m, (angles, torques) = self.model, self._table
        most = self.relaxed_angle - FLATTEST
        peak = float(self.deflection(self.peak_torque)) if np.isfinite(self.peak_torque) else most
        return CutCore(
            m.disk_radius, angles, torques, min(peak, most), m.free_speed, m.speed_droop, m.friction_ratio,
            m.specific_energy, m.idle_power, float(self.grinding_ratio),
        )  # fmt: skip
