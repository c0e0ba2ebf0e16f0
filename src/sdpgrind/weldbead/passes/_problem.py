"""Problem of one pass."""

from functools import cached_property
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, described, flag, law, part, quantity
from sdpgrind.base.warned import warn
from sdpgrind.weldbead.passes._contour import Contour, contour_shift, merged, volume_between
from sdpgrind.weldbead.passes._disk import TiltedDisc
from sdpgrind.weldbead.sequence._burn import BURN_LIMITS, NAMES, BurnLimit
from sdpgrind.weldbead.sequence._problem import FORCES

_ONE_OF_THEM = f"a {', '.join(NAMES[:-1])} or {NAMES[-1]}"


@described("weldbead.pass_problem")
class PassProblem(Described):
    """One pass over a measured bead: mean depth, target shape, limits.

    Parameters
    ----------
    disc : TiltedDisc
        Disc with its process.
    bead : Contour
        Scanned bead, mm.
    mean_cut : float
        Mean depth delta over the whole length, mm; it fixes a volume, Brown (6.1).
    feed_rate : float
        Feed along the bead, mm/s.
    target_shape : Contour, optional
        Target shape z_f, mm, shifted vertically to the volume. Default: level.
    parent : Contour, optional
        Surface that must not be ground, mm. A target below it is warned of, and refused without
        `allow_overground` where the bead lacks the volume.
    allow_overground : bool
        Whether more volume than lies above the parent may be asked for.
    normal_force_max : float
        Greatest normal force, N.
    burn_limit : BurnLimit, optional
        Burn limit; None: the work never burns.
    spacing : float
        Node distance of the simulation, mm.

    Raises
    ------
    ValueError
        When a value is not positive, the volume exceeds that above the parent, or the bead is too steep.

    Examples
    --------
    >>> from sdpgrind import units, weldbead
    >>> process = weldbead.GrindingProcess(12.8, 114.0, 0.33, 88.9, 500.0, 0.0, 12.7)
    >>> disc = TiltedDisc(process, relaxed_angle=units.deg(20), rotational_stiffness=6e5)
    >>> problem = PassProblem(disc, Contour([0, 75, 150], [1.0, 1.3, 1.0]), mean_cut=0.2, feed_rate=20.0)
    >>> round(problem.bead.mean - problem.target.mean, 12)
    0.2
    >>> problem.replace(specific_energy=14.0, feed_rate=10.0).disc.model.specific_energy  # J/mm^3
    14.0
    """

    _inside: ClassVar[str] = "disc"
    disc: TiltedDisc = part(TiltedDisc)
    bead: Contour = part(Contour)
    mean_cut: float = quantity("mm", at_least=0, usual=(0.0, 60.0), typical=0.2)
    feed_rate: float = quantity("mm/s", above=0, usual=(0.1, 1000.0), typical=20)
    target_shape: Contour | None = part(Contour, default=None)
    parent: Contour | None = part(Contour, default=None)
    allow_overground: bool = flag(default=False)
    normal_force_max: float = quantity("N", above=0, usual=FORCES, typical=50, default=90.0)
    burn_limit: BurnLimit | None = law(BURN_LIMITS, _ONE_OF_THEM, "interval", "margin", default=None)
    spacing: float = quantity("mm", above=0, usual=(1e-3, 50.0), typical=0.05, default=0.05)

    def _check(self) -> None:
        if self.spacing > self.bead.length / 10:
            raise self._refused("spacing", f"<= {self.bead.length / 10:g}, a tenth of the bead")
        if self.force_limit < float(self.disc.model.threshold_force):
            raise ValueError(
                f"normal_force_max must be > {float(self.disc.model.threshold_force):.4g}, below which"
                f" nothing is cut (N); the limits leave {self.force_limit:.4g}"
            )
        self._check_parent()
        self._check_steepness()
        self._warn_of_depth()

    def _check_parent(self) -> None:
        if self.parent is None:
            return
        there = volume_between(self.bead, self.parent, self.disc.model.bead_width)
        if self.volume > there and not self.allow_overground:
            raise ValueError(
                f"mean_cut must leave the parent alone: {self.volume:.4g} mm^3 are asked for and {there:.4g}"
                " lie above it; allow_overground=True grinds on"
            )
        over = volume_between(self.parent, self._covering(self.target), self.disc.model.bead_width)
        if over > 1e-9 * max(self.volume, 1.0):
            warn(f"the target lies below the parent: {over:.4g} mm^3 of it would be ground")

    def _warn_of_depth(self) -> None:
        """Warn of a cut deeper than the bead: without a parent, heights most likely count from the work."""
        if self.parent is None and self.mean_cut > self.bead.mean > 0 and not self.allow_overground:
            warn(
                f"mean_cut of {self.mean_cut:g} mm is deeper than the bead is high: {self.bead.mean:.4g} mm"
                " above 0; parent says where the work begins, allow_overground=True grinds into it"
            )

    def _covering(self, contour: Contour) -> Contour:
        assert self.parent is not None
        x = merged(
            contour, low=min(contour.x[0], self.parent.x[0]), high=max(contour.x[-1], self.parent.x[-1])
        )
        return Contour(x, contour.at(x))

    def _check_steepness(self) -> None:
        reach = self.disc.model.disk_radius * np.sin(self.disc.relaxed_angle)
        rise = max(self.bead.z) - min(self.tip_path.z)
        if rise >= reach:
            bumps = f"; mean_cut is {self.mean_cut:g} mm of it" if self.mean_cut > 0 else ""
            raise ValueError(
                f"the bead must rise < {reach:.4g} above the path of the tip, to the disc's center (mm);"
                f" got {rise:.4g}{bumps}"
            )

    @property
    def volume(self) -> float:
        """Volume to remove, delta w L, mm^3; Brown (6.1)."""
        return self.mean_cut * self.disc.model.bead_width * self.bead.length

    @property
    def shape(self) -> Contour:
        """Target shape before its shift, mm."""
        return self.target_shape or Contour([self.bead.x[0], self.bead.x[-1]], [0.0, 0.0])

    @cached_property
    def contour_shift(self) -> float:
        """Vertical shift N of the shape, mm; Brown (6.2b). On a parent of slope a the gap is N cos(a)."""
        return contour_shift(self.bead, self.shape, self.volume, self.disc.model.bead_width)

    @cached_property
    def tip_path(self) -> Contour:
        """Path of the tip, mm: the shifted shape, also over dips where it touches nothing."""
        return self.shape.shifted(self.contour_shift)

    @cached_property
    def target(self) -> Contour:
        """Contour that the pass should leave, mm: the lower of shifted shape and bead; Brown (6.2a)."""
        x = merged(self.bead, self.tip_path, low=self.bead.x[0], high=self.bead.x[-1])
        upper, lower = self.bead.at(x), self.tip_path.at(x)
        cross = np.flatnonzero((upper[1:] - lower[1:]) * (upper[:-1] - lower[:-1]) < 0)
        gap = upper - lower
        x = np.unique(
            np.concatenate([x, x[cross] + np.diff(x)[cross] * gap[cross] / (gap[cross] - gap[cross + 1])])
        )
        return Contour(x, np.minimum(self.bead.at(x), self.tip_path.at(x)))

    @property
    def force_limit(self) -> float:
        """Least limit on the normal force at the feed of the problem, N: `grinder_limit` or burning."""
        return min(self.grinder_limit, float(self.burn_force(self.feed_rate)))

    @property
    def grinder_limit(self) -> float:
        """Least limit on the normal force at any feed, N: greatest force and stall guard."""
        return min(self.normal_force_max, self.disc.guarded_force)

    def burn_force(self, feed_rate: npt.ArrayLike) -> Floats:
        """Return the normal force, N, above which the work burns at feeds, mm/s; inf: no burn limit."""
        feed = np.asarray(feed_rate, dtype=float)
        if self.burn_limit is None:
            return np.full(feed.shape, np.inf)
        some, place = np.unique(feed, return_inverse=True)  # a limit may take a root for each
        return np.asarray(self.burn_limit.interval(self.disc.model, some)[1])[place].reshape(feed.shape)

    @property
    def nodes(self) -> Floats:
        """Even nodes of the simulation, mm."""
        return self.nodes_at(self.spacing)

    def nodes_at(self, spacing: float) -> Floats:
        """Return even nodes, mm, at another spacing, mm."""
        return np.linspace(self.bead.x[0], self.bead.x[-1], max(10, round(self.bead.length / spacing)) + 1)

    @property
    def lead_in(self) -> float:
        """Distance of the tip's start before the bead, mm, at which the relaxed disc touches nothing."""
        x, z = np.array(self.bead.x), np.array(self.bead.z)
        above = np.maximum(0.0, z - float(self.tip_path.at(x[0]))) / np.tan(self.disc.relaxed_angle)
        return float(max(0.0, np.max(above - (x - x[0])))) + 2 * self.spacing
