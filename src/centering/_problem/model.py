"""A ring on a table and the tip that pushes it: mass, friction, contact."""

from typing import ClassVar

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, described, part, quantity
from sdpgrind.base.warned import warn

FORCE_MAX = 446.0  # range of the force sensor, N; source: Mears (2006)
GRAVITY = 9807.0  # mm/s^2; source: Mears (3.7)

_NEWTON = 1e-3  # N s^2/mm of a kg; derived from the units

_ROUGHEST = 2.0  # chosen: no dry contact has this coefficient of friction; a larger value is in percent


@described("centering.part")
class Part(Described):
    """Ring that lies on the table.

    Parameters
    ----------
    mass : float
        Mass of the ring, kg.
    radius : float
        Radius of the surface that the tip pushes, mm.

    Raises
    ------
    ValueError
        When a value is not > 0 or in another unit.

    Examples
    --------
    >>> Part(mass=18.9, radius=89.5)
    Part(mass=18.9 kg, radius=89.5 mm)
    """

    mass: float = quantity("kg", above=0, below=500.0, hint="; grams/1000")
    radius: float = quantity("mm", above=0, usual=(5.0, 5000.0), typical=90)


@described("centering.push_model")
class PushModel(Described):
    """Part pushed over a table: M x'' = F_c - F_f, Mears (5.26) and (5.27) with corrected signs.

    The contact is a spring and a damper that never pull. Friction is `breakaway_force` at rest; in motion it
    is `coulomb_force` plus a viscous share.

    Parameters
    ----------
    part : Part
        Mass (kg) and radius (mm); `replace` also takes ``mass`` and ``radius``.
    contact_stiffness : float
        Stiffness k of the contact, N/mm.
    contact_damping : float
        Damping b of the contact, N s/mm.
    mu_static, mu_kinetic : float
        Coefficients of friction at rest and in motion, unit 1.
    viscous_coefficient : float
        Viscous friction k_v, N s/mm.
    restitution : float
        Ratio of the speeds after and before a free impact, Mears (3.11), unit 1.

    Raises
    ------
    ValueError
        When a value is out of range or in another unit; mu_static must be >= mu_kinetic. Equal values warn
        that the part will not stick and slip.

    Examples
    --------
    >>> model = PushModel(Part(18.9, 89.5), 1200.0, 1.0, mu_static=0.2, mu_kinetic=0.15)
    >>> round(model.breakaway_force, 4), round(model.coulomb_force, 4)  # N
    (37.0705, 27.8028)
    >>> round(model.stick_slip_quantum, 6)  # mm
    0.015446
    >>> model.replace(mass=0.8).part
    Part(mass=0.8 kg, radius=89.5 mm)
    """

    part: Part = part(Part)
    contact_stiffness: float = quantity("N/mm", above=0, below=2e5, hint="; N/m over 1000")
    contact_damping: float = quantity("N s/mm", at_least=0)
    mu_static: float = quantity("1", above=0, below=_ROUGHEST, hint="; percent/100")
    mu_kinetic: float = quantity("1", above=0, below=_ROUGHEST, hint="; percent/100")
    viscous_coefficient: float = quantity("N s/mm", at_least=0, default=0.0)
    restitution: float = quantity("1", at_least=0, at_most=1, default=0.85)
    _inside: ClassVar[str] = "part"

    def _check(self) -> None:
        if self.mu_static < self.mu_kinetic:
            raise self._refused("mu_static", f">= mu_kinetic = {self.mu_kinetic:g}")
        if self.mu_static == self.mu_kinetic:
            warn(f"mu_static equals mu_kinetic = {self.mu_kinetic:g}: the part will not stick and slip")

    @property
    def inertia(self) -> float:
        """M, mass over 1000, N s^2/mm."""
        return self.part.mass * _NEWTON

    @property
    def weight(self) -> float:
        """M g, N."""
        return self.inertia * GRAVITY

    @property
    def breakaway_force(self) -> float:
        """F_s = mu_static M g, above which the part slides, N, Mears (2.3)."""
        return self.mu_static * self.weight

    @property
    def coulomb_force(self) -> float:
        """F_k = mu_kinetic M g, friction in motion without its viscous share, N, Mears (5.18)."""
        return self.mu_kinetic * self.weight

    @property
    def stick_slip_quantum(self) -> float:
        """Jump 2 (F_s - F_k)/k of a part in a slow push without damping, mm: the finest slow push."""
        return 2.0 * (self.breakaway_force - self.coulomb_force) / self.contact_stiffness

    @property
    def parameters(self) -> Floats:
        """M (N s^2/mm), k (N/mm), b (N s/mm), F_s (N), F_k (N), k_v (N s/mm), (6,), for compiled loops."""
        contact = (self.inertia, self.contact_stiffness, self.contact_damping)
        return np.array([*contact, self.breakaway_force, self.coulomb_force, self.viscous_coefficient])
