"""The example that Koren carries through his paper, with everything that it gives in closed form."""

from collections.abc import Mapping
from dataclasses import KW_ONLY
from typing import Any

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, described, quantity
from sdpgrind.locus._problem.process import Varying

ONSET = 0.5
"""Hidden state above which the constraint is active, at scale 1."""


@described("locus.koren_example")
class KorenExample(Described):
    """Minimise (u - 1)^2 + (v - 4)^2 while x v + 16 - 4 v stays under 17 + u - 4 v: Koren (14) to (18), (25), (26).

    Controls are ``u`` and ``v``, the hidden state is ``x``; none has a unit. The constraint is active from x = 1/2 on. There the
    locus is the circle u^2 + (v - 2)^2 = 5, and it is walked along by v: u rises up to x = (1 + sqrt 5)/2 and falls again.

    Parameters
    ----------
    scale : float
        m in the response m x v + 16 - 4 v, unit 1: what the model does not know of its own response. It calibrates the locus
        by x anew; neither the locus nor its calibration by the response knows it.

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
        """The one constraint: the response x v + 16 - 4 v, Koren (26), under the limit 17 + u - 4 v, (25); unit 1."""
        return (Varying(response=self._response, limit=self._limit),)

    @property
    def units(self) -> Mapping[str, str]:
        """No units: the example has no physical meaning."""
        return {}

    def cost(self, s: Any, c: Any) -> Any:
        """Return (u - 1)^2 + (v - 4)^2 of the controls ``c``, Koren (14), unit 1; the hidden state ``s`` is not in it."""
        return (c.u - 1) ** 2 + (c.v - 4) ** 2

    def _response(self, s: Any, c: Any) -> Any:
        return self.scale * s.x * c.v + 16 - 4 * c.v

    def _limit(self, s: Any, c: Any) -> Any:
        return 17 + c.u - 4 * c.v

    def point(self, x: npt.ArrayLike) -> tuple[Floats, Floats]:
        """Return u and v of the optimum at a hidden state: (x^2 + 4x - 1, 4 + 2x)/(1 + x^2), and (1, 4) where x < 1/2.

        They solve (17) with P = 0 of (16). At another scale x is m x. Nothing has a unit.
        """
        y = np.maximum(self.scale * np.asarray(x, dtype=float), ONSET)
        return (y**2 + 4 * y - 1) / (1 + y**2), (4 + 2 * y) / (1 + y**2)

    def multiplier(self, x: npt.ArrayLike) -> Floats:
        """Return the multiplier lambda = 2 (u - 1) (unit 1) of the constraint at the optimum of x, by Koren (9)."""
        return 2 * (self.point(x)[0] - 1)

    def hidden_state(self, v: npt.ArrayLike) -> Floats:
        """Return the x at which v is optimal, (u + 1)/(m v), unit 1: the calibration of the locus by x."""
        return (self.u_on_locus(v) + 1) / (self.scale * np.asarray(v, dtype=float))

    def u_on_locus(self, v: npt.ArrayLike) -> Floats:
        """Return u of the locus at v in (0, 4]: + sqrt(5 - (v - 2)^2), Koren (18), unit 1.

        Above 4 the multiplier is negative, and the circle is no locus.

        Raises
        ------
        ValueError
            When v is no point of the locus.
        """
        given = checks.finite_array("v", v)
        if not np.all((given > 0) & (given <= 4)):
            raise checks.refuse("v", "in (0, 4], where the locus is", v)
        return np.asarray(np.sqrt(5 - (given - 2) ** 2))

    def loop_slope(self, x: npt.ArrayLike) -> Floats:
        """Return e_v (unit 1), the slope of limit - response by v along the locus, with x held at its value.

        It is (2 - v)/u - x, or -(x^2 + 1)(x + 2)/(x^2 + 4x - 1): never 0 from x = 1/2 on, so that v leads the whole way.

        Raises
        ------
        ValueError
            When x is below 1/2 (at scale 1): no constraint is active there.
        """
        y = self._active(x)
        return -(y**2 + 1) * (y + 2) / (y**2 + 4 * y - 1)

    def gain_max(self, x: npt.ArrayLike) -> Floats:
        """Return the gain k (unit 1) below which v + k e comes to rest at the optimum of x: ``2/|e_v|``."""
        return 2 / np.abs(self.loop_slope(x))

    def gain_without_overshoot(self, x: npt.ArrayLike) -> Floats:
        """Return the gain k (unit 1) up to which v + k e never passes the optimum of x from below: ``1/|e_v|`` (e is concave)."""
        return 1 / np.abs(self.loop_slope(x))

    def retrieval_multiplier(self, x: npt.ArrayLike) -> Floats:
        """Return what a response, read at one point to call the next, leaves of an error: (m x - 4)/((2 - v)/u - 4), unit 1.

        Beyond -1 the call of Koren's Fig. 2 runs away: from x = 6.92738 on.
        """
        y = self._active(x)
        u, v = self.point(x)
        return (y - 4) / ((2 - v) / u - 4)

    def _active(self, x: npt.ArrayLike) -> Floats:
        y = self.scale * checks.finite_array("x", x)
        if not np.all(y >= ONSET):
            raise checks.refuse("x", f">= {ONSET / self.scale:g}, where the constraint is active", x)
        return y
