"""The example of Koren's paper, with its closed forms."""

from collections.abc import Mapping
from dataclasses import KW_ONLY
from typing import Any

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, described, quantity
from sdpgrind.locus._problem.process import Varying

ONSET = 0.5  # derived: hidden state above which the constraint is active, at scale 1


@described("locus.koren_example")
class KorenExample(Described):
    """Minimise (u - 1)^2 + (v - 4)^2 with x v + 16 - 4 v <= 17 + u - 4 v: Koren (14) to (18), (25), (26).

    Controls ``u`` and ``v`` and hidden state ``x`` have no units. The constraint is active from x = 1/2 on;
    there the locus is the circle u^2 + (v - 2)^2 = 5. u rises up to x = (1 + sqrt 5)/2 and falls again.

    Parameters
    ----------
    scale : float
        m in the response m x v + 16 - 4 v, unit 1: an error of the model. It changes the calibration of the
        locus by x; neither the locus nor its calibration by the response depends on it.

    Raises
    ------
    ValueError
        When the scale is not positive.

    Examples
    --------
    >>> example = KorenExample()
    >>> u, v = example.point(1.0)
    >>> float(u), float(v), float(example.multiplier(1.0)), float(example.loop_slope(1.0))
    (2.0, 3.0, 2.0, -1.5)
    """

    _: KW_ONLY
    scale: float = quantity("1", above=0, default=1.0)

    @property
    def constraints(self) -> tuple[Varying, ...]:
        """Response x v + 16 - 4 v, Koren (26), <= limit 17 + u - 4 v, (25); unit 1."""
        return (Varying(response=self._response, limit=self._limit),)

    @property
    def units(self) -> Mapping[str, str]:
        """No units: the example is dimensionless."""
        return {}

    def cost(self, s: Any, c: Any) -> Any:
        """Return (u - 1)^2 + (v - 4)^2 of the controls ``c``, Koren (14), unit 1; state ``s`` unused."""
        return (c.u - 1) ** 2 + (c.v - 4) ** 2

    def _response(self, s: Any, c: Any) -> Any:
        return self.scale * s.x * c.v + 16 - 4 * c.v

    def _limit(self, s: Any, c: Any) -> Any:
        return 17 + c.u - 4 * c.v

    def point(self, x: npt.ArrayLike) -> tuple[Floats, Floats]:
        """Return u and v of the optimum: (x^2 + 4x - 1, 4 + 2x)/(1 + x^2), (1, 4) for x < 1/2; no units.

        They solve (17) with P = 0 of (16). At another scale x is m x.
        """
        y = np.maximum(self.scale * np.asarray(x, dtype=float), ONSET)
        return (y**2 + 4 * y - 1) / (1 + y**2), (4 + 2 * y) / (1 + y**2)

    def multiplier(self, x: npt.ArrayLike) -> Floats:
        """Return the multiplier lambda = 2 (u - 1) (unit 1) at the optimum of x, by Koren (9)."""
        return 2 * (self.point(x)[0] - 1)

    def hidden_state(self, v: npt.ArrayLike) -> Floats:
        """Return the x of an optimal v, (u + 1)/(m v), unit 1: calibration of the locus by x."""
        return (self.u_on_locus(v) + 1) / (self.scale * np.asarray(v, dtype=float))

    def u_on_locus(self, v: npt.ArrayLike) -> Floats:
        """Return u of the locus at v in (0, 4]: + sqrt(5 - (v - 2)^2), Koren (18), unit 1.

        Above 4 the multiplier is negative.

        Raises
        ------
        ValueError
            When v is outside (0, 4].
        """
        given = checks.finite_array("v", v)
        if not np.all((given > 0) & (given <= 4)):
            raise checks.refuse("v", "in (0, 4], where the locus is", v)
        return np.asarray(np.sqrt(5 - (given - 2) ** 2))

    def loop_slope(self, x: npt.ArrayLike) -> Floats:
        """Return e_v (unit 1), the slope of limit - response by v along the locus, at fixed x.

        It is (2 - v)/u - x = -(x^2 + 1)(x + 2)/(x^2 + 4x - 1), nonzero from x = 1/2 on.

        Raises
        ------
        ValueError
            When x is below 1/2 (at scale 1), without active constraint.
        """
        y = self._active(x)
        return -(y**2 + 1) * (y + 2) / (y**2 + 4 * y - 1)

    def gain_max(self, x: npt.ArrayLike) -> Floats:
        """Return the gain k (unit 1) below which v + k e converges to the optimum of x: ``2/|e_v|``."""
        return 2 / np.abs(self.loop_slope(x))

    def gain_without_overshoot(self, x: npt.ArrayLike) -> Floats:
        """Return the greatest gain k (unit 1) of v + k e without overshoot at x: ``1/|e_v|``."""
        return 1 / np.abs(self.loop_slope(x))

    def retrieval_multiplier(self, x: npt.ArrayLike) -> Floats:
        """Return the error factor of one reading, (m x - 4)/((2 - v)/u - 4) at x, unit 1.

        Below -1 the method of Koren's Fig. 2 diverges: from x = 6.92738 on.
        """
        y = self._active(x)
        u, v = self.point(x)
        return (y - 4) / ((2 - v) / u - 4)

    def _active(self, x: npt.ArrayLike) -> Floats:
        y = self.scale * checks.finite_array("x", x)
        if not np.all(y >= ONSET):
            raise checks.refuse("x", f">= {ONSET / self.scale:g}, where the constraint is active", x)
        return y
