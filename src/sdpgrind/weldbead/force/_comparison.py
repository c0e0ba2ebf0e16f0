"""Feedback designs compared at equal limits."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from sdpgrind.weldbead.force._designs import DesignLimits, DisturbanceObserver, q_loop, tuned_pi
from sdpgrind.weldbead.force._feedback import ForceLoop, ForcePlant
from sdpgrind.weldbead.force._margins import margins
from sdpgrind.weldbead.force._predictive import Predictive

if TYPE_CHECKING:
    import xarray as xr

_COLUMNS = {
    "bandwidth": ("rad/s", "f_b, slope-limited"),
    "gain_margin_db": ("dB", "gain margin"),
    "phase_margin": ("rad", "phase margin"),
    "sensitivity_peak": ("1", "Ms"),
    "complementary_peak": ("1", "Mt"),
    "runout_response": ("1", "largest response to runout, 20 to 50 Hz"),
    "tracking_bandwidth": ("rad/s", "-3 dB of T"),
}


def designs(plant: ForcePlant | None = None, limits: DesignLimits | None = None) -> list[ForceLoop]:
    """Return the best PI, observer, predictive and convex loop within `limits` on a `plant` (mm to N)."""
    predictive = Predictive.design(plant, limits).loop
    return [
        tuned_pi(plant, limits),
        DisturbanceObserver.design(plant, limits),
        predictive,
        q_loop(plant, limits),
    ]


def design_table(loops: Iterable[ForceLoop]) -> "xr.Dataset":
    """Return margins, bandwidth (rad/s) and runout response of `loops`, one row each.

    Examples
    --------
    >>> from sdpgrind import units
    >>> from sdpgrind.weldbead import force
    >>> table = force.design_table([force.PI.design(crossover=units.hz(f)) for f in (1.0, 3.0)])
    >>> table.bandwidth.attrs["units"], table.sizes["design"]
    ('rad/s', 2)
    """
    import xarray as xr

    loops = list(loops)
    rows = [margins(loop) for loop in loops]
    columns = {
        name: ("design", np.array([getattr(row, name) for row in rows]), {"units": unit, "long_name": words})
        for name, (unit, words) in _COLUMNS.items()
    }
    return xr.Dataset(columns, {"design": [loop.name for loop in loops]})
