"""Friction laws without memory: Coulomb's, with a viscous share, Stribeck's (Mears, chapter 2)."""

from typing import ClassVar

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, described, quantity

STRIBECK_SPEED = 1.0  # mm/s, chosen: a larger one spreads the fall of friction over faster pushes
SLOTS = {
    "breakaway_force": 0.0,
    "coulomb_force": 0.0,
    "viscous_coefficient": 0.0,
    "stribeck_speed": STRIBECK_SPEED,
    "stribeck_exponent": 2.0,
    "bristle_stiffness": 0.0,
    "bristle_damping": 0.0,
    "elastic_limit": 0.0,
}


@described()
class CoulombFriction(Described):
    """Coulomb friction, Mears (2.1), (2.3), (2.4): F_k sgn v; at rest it balances up to F_s.

    Parameters
    ----------
    breakaway_force, coulomb_force : float
        F_s and F_k, N; 0 < F_k <= F_s.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> law = CoulombFriction(breakaway_force=37.0, coulomb_force=28.0)
    >>> [float(law.force(v, applied=load)) for v, load in ((-2.0, 0.0), (0.0, 30.0), (0.0, 40.0))]  # N
    [-28.0, 30.0, 37.0]
    """

    breakaway_force: float = quantity("N")
    coulomb_force: float = quantity("N", above=0)
    kind: ClassVar[int] = 0
    states: ClassVar[int] = 0

    def _check(self) -> None:
        if self.breakaway_force < self.coulomb_force:
            raise self._refused("breakaway_force", f">= coulomb_force = {self.coulomb_force:g}")

    def force(self, v: npt.ArrayLike, state: npt.ArrayLike = 0.0, applied: npt.ArrayLike = 0.0) -> Floats:
        """Return the friction force, N; its sign is that of `v`, at rest that of `applied`.

        Parameters
        ----------
        v : array_like
            Speed, mm/s.
        state : array_like
            Deflection, mm; without effect in laws without memory.
        applied : array_like
            Force to be balanced at rest, N.
        """
        speed, load = np.asarray(v, dtype=float), np.asarray(applied, dtype=float)
        held = np.clip(load, -self.breakaway_force, self.breakaway_force)
        return np.asarray(np.where(speed == 0.0, held, np.sign(speed) * self.sliding_force(speed)))

    def sliding_force(self, v: npt.ArrayLike) -> Floats:
        """Return the magnitude of the force in steady motion, N.

        Parameters
        ----------
        v : array_like
            Speed, mm/s.
        """
        return np.full(np.shape(v), self.coulomb_force)

    def rate(self, v: npt.ArrayLike, state: npt.ArrayLike = 0.0) -> Floats:
        """Return the rate of the state, mm/s; 0 for laws without memory.

        Parameters
        ----------
        v, state : array_like
            Speed, mm/s, and deflection, mm.
        """
        return np.zeros(np.broadcast_shapes(np.shape(v), np.shape(state)))

    @property
    def parameters(self) -> Floats:
        """F_s, F_k (N), k_v (N s/mm), v_S (mm/s), delta_S (1), s0 (N/mm), s1 (N s/mm), z_ba (mm), (8,)."""
        return np.array([float(getattr(self, name, default)) for name, default in SLOTS.items()])


@described()
class ViscousFriction(CoulombFriction):
    """Coulomb and viscous friction, Mears (2.2) with its missing sign: (F_k + k_v ``|v|``) sgn v.

    Parameters
    ----------
    breakaway_force, coulomb_force, viscous_coefficient : float
        F_s and F_k, N; k_v, N s/mm; 0 < F_k <= F_s.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> float(ViscousFriction(37.0, 28.0, viscous_coefficient=0.1).force(-20.0))  # N
    -30.0
    """

    viscous_coefficient: float = quantity("N s/mm", at_least=0, default=0.0)
    kind: ClassVar[int] = 1

    def sliding_force(self, v: npt.ArrayLike) -> Floats:
        """Return the magnitude of the force in steady motion, N.

        Parameters
        ----------
        v : array_like
            Speed, mm/s.
        """
        return self.coulomb_force + self.viscous_coefficient * np.abs(v)


@described()
class StribeckFriction(ViscousFriction):
    """Friction that falls from F_s to F_k with rising speed, Mears (2.5) with its missing sign.

    (F_k + (F_s - F_k) exp(-``|v/v_S|``^delta_S) + k_v ``|v|``) sgn v; at rest it balances up to F_s.

    Parameters
    ----------
    breakaway_force, coulomb_force, viscous_coefficient : float
        F_s and F_k, N; k_v, N s/mm; 0 < F_k <= F_s.
    stribeck_speed, stribeck_exponent : float
        v_S, mm/s, and delta_S, unit 1.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> law = StribeckFriction(37.0, 28.0, stribeck_speed=2.0)
    >>> law.force([1e-9, 2.0, 20.0]).round(3).tolist()  # N
    [37.0, 31.311, 28.0]
    """

    stribeck_speed: float = quantity(
        "mm/s", above=0, usual=(0.01, 1000.0), typical=STRIBECK_SPEED, default=STRIBECK_SPEED
    )
    stribeck_exponent: float = quantity("1", above=0, default=2.0)
    kind: ClassVar[int] = 2

    def sliding_force(self, v: npt.ArrayLike) -> Floats:
        """Return the magnitude of the force in steady motion, N.

        Parameters
        ----------
        v : array_like
            Speed, mm/s.
        """
        return self.stribeck(v) + self.viscous_coefficient * np.abs(v)

    def stribeck(self, v: npt.ArrayLike) -> Floats:
        """Return g(v), the force in steady motion without its viscous share, N.

        Parameters
        ----------
        v : array_like
            Speed, mm/s.
        """
        fade = np.exp(-(np.abs(np.asarray(v, dtype=float) / self.stribeck_speed) ** self.stribeck_exponent))
        return np.asarray(self.coulomb_force + (self.breakaway_force - self.coulomb_force) * fade)
