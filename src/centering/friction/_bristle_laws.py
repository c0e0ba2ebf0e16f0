"""Friction laws with a bond that deflects before sliding: Dahl, LuGre, elasto-plastic (Mears, chapter 2)."""

from collections.abc import Callable
from math import pi, sqrt
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from centering._problem.model import PushModel
from centering.friction._laws import SLOTS, CoulombFriction, StribeckFriction, ViscousFriction
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, described, quantity, units_of

BRISTLE = 100.0  # chosen: stiffness before sliding over that of the contact; the source gives none
_ELASTIC = 0.8  # chosen: default elastic limit over the deflection at which Coulomb friction slides


@described()
class DahlFriction(Described):
    """Dahl's law: a spring that yields, z' = v - (s0/F_k) ``|v|`` z, F = s0 z. It has no stiction.

    Parameters
    ----------
    coulomb_force, bristle_stiffness : float
        F_k, N, and s0, N/mm.

    Raises
    ------
    ValueError
        When a value is not > 0.

    Examples
    --------
    >>> law = DahlFriction(coulomb_force=28.0, bristle_stiffness=1.2e5)
    >>> float(law.force(1.0, 1e-4)), float(law.rate(1.0, 28.0 / 1.2e5).round(9))  # N, mm/s
    (12.0, 0.0)
    """

    coulomb_force: float = quantity("N", above=0)
    bristle_stiffness: float = quantity("N/mm", above=0)
    kind: ClassVar[int] = 3
    states: ClassVar[int] = 1

    def force(self, v: npt.ArrayLike, state: npt.ArrayLike = 0.0, applied: npt.ArrayLike = 0.0) -> Floats:
        """Return the friction force, N.

        Parameters
        ----------
        v, state, applied : array_like
            Speed, mm/s; deflection z, mm; applied force, N, without effect, as the deflection balances it.
        """
        return np.asarray(
            self.bristle_stiffness * np.asarray(state, dtype=float) + 0.0 * np.asarray(v, dtype=float)
        )

    def rate(self, v: npt.ArrayLike, state: npt.ArrayLike = 0.0) -> Floats:
        """Return the rate of the deflection, mm/s.

        Parameters
        ----------
        v, state : array_like
            Speed, mm/s, and deflection z, mm.
        """
        speed, z = np.asarray(v, dtype=float), np.asarray(state, dtype=float)
        return np.asarray(speed - self.bristle_stiffness / self.coulomb_force * np.abs(speed) * z)

    @property
    def parameters(self) -> Floats:
        """F_s, F_k (N), k_v (N s/mm), v_S (mm/s), delta_S (1), s0 (N/mm), s1 (N s/mm), z_ba (mm), (8,)."""
        values = dict(SLOTS, coulomb_force=self.coulomb_force, breakaway_force=self.coulomb_force)
        return np.array([*(values | {"bristle_stiffness": self.bristle_stiffness}).values()])


@described()
class LuGreFriction(StribeckFriction):
    """Law of Lund and Grenoble: z' = v - s0 ``|v|`` z/g(v), F = s0 z + s1 z' + k_v v, g Stribeck's curve.

    A part held by it creeps under a load that oscillates below the breakaway force; `ElastoPlasticFriction`
    does not.

    Parameters
    ----------
    breakaway_force, coulomb_force, viscous_coefficient, stribeck_speed, stribeck_exponent : float
        See `StribeckFriction`; N, N, N s/mm, mm/s, unit 1.
    bristle_stiffness, bristle_damping : float
        s0, N/mm, and s1, N s/mm.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> law = LuGreFriction(37.0, 28.0, bristle_stiffness=1.2e5, bristle_damping=48.0)
    >>> z = float(law.stribeck(0.5)) / 1.2e5  # mm: steady motion at 0.5 mm/s
    >>> round(float(law.force(0.5, z)), 3), round(float(law.sliding_force(0.5)), 3)  # N
    (35.009, 35.009)
    """

    bristle_stiffness: float = quantity("N/mm", above=0, default=1.2e5)
    bristle_damping: float = quantity("N s/mm", at_least=0, default=0.0)
    kind: ClassVar[int] = 4
    states: ClassVar[int] = 1

    def force(self, v: npt.ArrayLike, state: npt.ArrayLike = 0.0, applied: npt.ArrayLike = 0.0) -> Floats:
        """Return the friction force, N.

        Parameters
        ----------
        v, state, applied : array_like
            Speed, mm/s; deflection z, mm; applied force, N, without effect, as the deflection balances it.
        """
        spring = self.bristle_stiffness * np.asarray(state, dtype=float)
        drag = self.viscous_coefficient * np.asarray(v, dtype=float)
        return np.asarray(spring + self.bristle_damping * self.rate(v, state) + drag)

    def rate(self, v: npt.ArrayLike, state: npt.ArrayLike = 0.0) -> Floats:
        """Return the rate of the deflection, mm/s.

        Parameters
        ----------
        v, state : array_like
            Speed, mm/s, and deflection z, mm.
        """
        speed, z = np.asarray(v, dtype=float), np.asarray(state, dtype=float)
        return np.asarray(
            speed
            - self.yielding(speed, z) * self.bristle_stiffness * np.abs(speed) * z / self.stribeck(speed)
        )

    def yielding(self, v: npt.ArrayLike, state: npt.ArrayLike) -> Floats:
        """Return alpha, the share of the motion in which the bond yields, dimensionless: 1 in this law.

        Parameters
        ----------
        v, state : array_like
            Speed, mm/s, and deflection z, mm.
        """
        return np.ones(np.broadcast_shapes(np.shape(v), np.shape(state)))


@described()
class ElastoPlasticFriction(LuGreFriction):
    """LuGre's law with a deflection truly elastic up to z_ba: z' = v (1 - alpha(z, v) s0 z sgn(v)/g(v)).

    alpha is 0 up to z_ba and where the motion relieves the deflection, and rises by half a sine to 1 at z_ss
    = g/s0.

    Parameters
    ----------
    breakaway_force, coulomb_force, viscous_coefficient, stribeck_speed, stribeck_exponent : float
        See `StribeckFriction`; N, N, N s/mm, mm/s, unit 1.
    bristle_stiffness, bristle_damping : float
        s0, N/mm, and s1, N s/mm.
    elastic_limit : float
        z_ba, mm, below F_k/s0. Default: 0.8 of that.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> law = ElastoPlasticFriction(37.0, 28.0, bristle_stiffness=1.2e5)
    >>> law.elastic_limit, law.yielding(1e-3, [1e-4, 2.5e-4, 1.0]).round(3).tolist()  # mm, dimensionless
    (0.0001866666666666667, [0.0, 0.532, 1.0])
    """

    elastic_limit: float | None = quantity("mm", above=0, default=None)
    kind: ClassVar[int] = 5

    def _check(self) -> None:
        super()._check()
        slides = self.coulomb_force / self.bristle_stiffness
        if self.elastic_limit is None:
            object.__setattr__(self, "elastic_limit", _ELASTIC * slides)
        elif self.elastic_limit >= slides:
            raise self._refused("elastic_limit", f"< coulomb_force/bristle_stiffness = {slides:.6g}")

    def yielding(self, v: npt.ArrayLike, state: npt.ArrayLike) -> Floats:
        """Return alpha, the share of the motion in which the bond yields, dimensionless, 0 to 1.

        Parameters
        ----------
        v, state : array_like
            Speed, mm/s, and deflection z, mm.
        """
        speed, z = np.asarray(v, dtype=float), np.asarray(state, dtype=float)
        low = float(self.elastic_limit or 0.0)
        rise = (np.abs(z) - low) / (self.stribeck(speed) / self.bristle_stiffness - low)
        alpha = 0.5 + 0.5 * np.sin(pi * (np.clip(rise, 0.0, 1.0) - 0.5))
        return np.where(speed * z > 0, alpha, 0.0)


FrictionLaw = CoulombFriction | DahlFriction
"""Any of the six laws; the other four are subclasses of the first."""

_STEADY = {"coulomb": CoulombFriction, "viscous": ViscousFriction, "stribeck": StribeckFriction}
_BRISTLE = {"lugre": LuGreFriction, "elasto_plastic": ElastoPlasticFriction}
LAWS = (*_STEADY, "dahl", *_BRISTLE)


def friction_law(model: PushModel, law: str = "elasto_plastic", **options: Any) -> FrictionLaw:
    """Return a friction law with the forces of a push model.

    The stiffness before sliding is 100 times that of the contact, its damping sqrt(s0 M); the source gives
    neither.

    Parameters
    ----------
    model : PushModel
        Friction, mass and contact.
    law : {"coulomb", "viscous", "stribeck", "dahl", "lugre", "elasto_plastic"}
        Name of the law.
    **options
        Fields of the law that differ, in their units.

    Raises
    ------
    ValueError
        For another name, or a field that the law does not have.

    Examples
    --------
    >>> from centering import preset
    >>> law = friction_law(preset("printed").model, "lugre")
    >>> law.bristle_stiffness, round(law.bristle_damping, 3)  # N/mm, N s/mm
    (120000.0, 47.624)
    """
    checks.kind("model", model, PushModel)
    checks.one_of("law", law, LAWS)
    stiffness = BRISTLE * model.contact_stiffness
    if law == "dahl":
        return DahlFriction(model.coulomb_force, stiffness).replace(**options)
    forces: dict[str, float] = {
        "breakaway_force": model.breakaway_force,
        "coulomb_force": model.coulomb_force,
    }
    if law != "coulomb":
        forces["viscous_coefficient"] = model.viscous_coefficient
    if law in _BRISTLE:
        unit = units_of(LuGreFriction)["bristle_stiffness"]
        softer = checks.positive("bristle_stiffness", options.get("bristle_stiffness", stiffness), unit)
        forces |= {"bristle_stiffness": softer, "bristle_damping": sqrt(softer * model.inertia)}
    made: Callable[..., CoulombFriction] = {**_STEADY, **_BRISTLE}[law]
    return made(**forces).replace(**options)
