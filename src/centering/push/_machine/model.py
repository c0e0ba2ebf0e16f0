"""A ring on a table and the tip that pushes it: mass, friction, contact."""

import dataclasses
from typing import ClassVar

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen
from sdpgrind.base.stored import stored
from sdpgrind.base.warned import warn

GRAVITY = 9807.0
"""Acceleration of gravity, mm/s^2, Mears (3.7)."""

_NEWTON = 1e-3  # N s^2/mm of a kg

# What no ring and no tip reaches, in the library's units, and what was meant then.
_HEAVIEST, _STIFFEST, _ROUGHEST = 500.0, 2e5, 2.0


def below(name: str, value: float, most: float, unit: str, hint: str) -> float:
    """Return a number; one so large that it smells of another unit is refused with the way to write it."""
    if value >= most:
        raise checks.refuse(name, f"< {most:g}; {hint}", value, unit)
    return value


@stored("centering.part")
@dataclasses.dataclass(frozen=True)
class Part(Frozen):
    """A ring that lies on the table.

    Parameters
    ----------
    mass : float
        kg.
    radius : float
        Of the surface that is pushed, mm.

    Raises
    ------
    ValueError
        When a value is not > 0, or a mass smells of grams.

    Examples
    --------
    >>> Part(mass=18.9, radius=89.5)
    Part(mass=18.9, radius=89.5)
    """

    mass: float
    radius: float

    def __post_init__(self) -> None:
        below("mass", checks.positive("mass", self.mass, "kg"), _HEAVIEST, "kg", "grams/1000")
        checks.positive("radius", self.radius, "mm")


@stored("centering.push_model")
@dataclasses.dataclass(frozen=True)
class PushModel(Frozen):
    """A part that a tip pushes over a table with friction: M x'' = F_c - F_f, Mears (5.26) and (5.27) with the signs mended.

    The contact is a spring and a damper that only push; the friction is `breakaway_force` at rest, and `coulomb_force` with a
    viscous share in motion.

    Parameters
    ----------
    part : Part
        Mass (kg) and radius (mm); `replace` takes ``mass`` and ``radius`` too.
    contact_stiffness : float
        k, N/mm.
    contact_damping : float
        b, N s/mm.
    mu_static, mu_kinetic : float
        Coefficients of friction at rest and in motion, dimensionless.
    viscous_coefficient : float
        k_v, N s/mm.
    restitution : float
        Ratio of speeds after and before a free impact, Mears (3.11), dimensionless.

    Raises
    ------
    ValueError
        When a value is out of range or smells of another unit; mu_static must be >= mu_kinetic, and where they are equal a
        warning tells that nothing sticks.

    Examples
    --------
    >>> model = PushModel(Part(18.9, 89.5), contact_stiffness=1200.0, contact_damping=1.0, mu_static=0.2, mu_kinetic=0.15)
    >>> round(model.breakaway_force, 4), round(model.coulomb_force, 4), round(model.stick_slip_quantum, 6)  # N, N, mm
    (37.0705, 27.8028, 0.015446)
    >>> model.replace(mass=0.8).part
    Part(mass=0.8, radius=89.5)
    """

    part: Part
    contact_stiffness: float
    contact_damping: float
    mu_static: float
    mu_kinetic: float
    viscous_coefficient: float = 0.0
    restitution: float = 0.85
    _inside: ClassVar[str] = "part"

    def __post_init__(self) -> None:
        checks.kind("part", self.part, Part)
        stiffness = checks.positive("contact_stiffness", self.contact_stiffness, "N/mm")
        below("contact_stiffness", stiffness, _STIFFEST, "N/mm", "N/m over 1000")
        checks.nonnegative("contact_damping", self.contact_damping, "N s/mm")
        below("mu_kinetic", checks.positive("mu_kinetic", self.mu_kinetic, "1"), _ROUGHEST, "1", "percent/100")
        checks.nonnegative("viscous_coefficient", self.viscous_coefficient, "N s/mm")
        checks.within("restitution", self.restitution, 0.0, 1.0, "1")
        self._check_static()

    def _check_static(self) -> None:
        below("mu_static", checks.positive("mu_static", self.mu_static, "1"), _ROUGHEST, "1", "percent/100")
        if self.mu_static < self.mu_kinetic:
            raise checks.refuse("mu_static", f">= mu_kinetic = {self.mu_kinetic:g}", self.mu_static, "1")
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
        """F_s = mu_static M g: what sets the part in motion, N, Mears (2.3)."""
        return self.mu_static * self.weight

    @property
    def coulomb_force(self) -> float:
        """F_k = mu_kinetic M g: the friction in motion without its viscous share, N, Mears (5.18)."""
        return self.mu_kinetic * self.weight

    @property
    def stick_slip_quantum(self) -> float:
        """Jump 2 (F_s - F_k)/k that a slow push without damping moves the part by, mm: no slow push is finer."""
        return 2.0 * (self.breakaway_force - self.coulomb_force) / self.contact_stiffness

    @property
    def parameters(self) -> Floats:
        """M (N s^2/mm), k (N/mm), b (N s/mm), F_s (N), F_k (N), k_v (N s/mm), (6,): what compiled loops take."""
        contact = (self.inertia, self.contact_stiffness, self.contact_damping)
        return np.array([*contact, self.breakaway_force, self.coulomb_force, self.viscous_coefficient])
