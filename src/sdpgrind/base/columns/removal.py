"""Whether a removal rate is in its unit: by its energy and by the width that depth and feed imply."""

from collections.abc import Mapping
from math import isfinite, nan

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.columns.request import Bound, unit_of_name
from sdpgrind.base.columns.sheet import Column
from sdpgrind.base.columns.table import quantity_of
from sdpgrind.base.unit_text import factor, near

_ENERGY = (2.0, 150.0)  # J/mm^3; chosen: of grinding, from soft metal to fine cuts
_WIDTH = (2.0, 200.0)  # mm; chosen: of beads
_RATE = "removal_rate"


def removal_fault(columns: Mapping[str, Column], bounds: Mapping[str, Bound]) -> str | None:
    """Return why a removal rate contradicts power, or depth and feed; None: it does not, or they are missing.

    Each must be what a machine can mean; where both are there, one of them must be usual, too.
    """
    if _RATE not in columns:
        return None
    energy, width = _energy(columns), _width(columns)
    if not _is_odd(energy, width, 1.0):
        return None
    each = bounds[_RATE]
    ours, used = unit_of_name(_RATE), factor(each.unit, unit_of_name(_RATE))
    others = [other for other in (ours, *near(ours)) if other != each.unit]
    fitting = [other for other in others if not _is_odd(energy, width, factor(other, ours) / used)]
    got = [f"specific energy {energy:.3g} J/mm^3"] * isfinite(energy)
    got += [f"bead width {width:.3g} mm"] * isfinite(width)
    calls = " or ".join(each.call(unit=other) for other in fitting)
    more = f"; in another unit: {calls}" if calls else ""
    return (
        f"{_RATE} must agree with power, depth and feed; they imply {' and '.join(got)}{more}"
        " (plausible=False takes it as it is)"
    )


def _is_odd(energy: float, width: float, times: float) -> bool:
    """Whether a rate that is `times` as great still implies what no machine means."""
    pairs = ((energy / times, "specific_energy", _ENERGY), (width * times, "bead_width", _WIDTH))
    known = [(value, quantity_of(name), usual) for value, name, usual in pairs if isfinite(value)]
    if any(not meant.least <= value <= meant.greatest for value, meant, _ in known):
        return True
    return len(known) > 1 and all(not low <= value <= high for value, _, (low, high) in known)


def _energy(columns: Mapping[str, Column]) -> float:
    """Power over removal rate, J/mm^3; NaN: not known."""
    if "grinding_power" not in columns:
        return nan
    return _ratio(columns["grinding_power"], columns[_RATE])


def _width(columns: Mapping[str, Column]) -> float:
    """Removal rate over depth and feed, mm; NaN: not known."""
    if not {"cut_depth", "feed_rate"} <= columns.keys():
        return nan
    return _ratio(columns[_RATE], columns["cut_depth"] * columns["feed_rate"])


def _ratio(numbers: Floats, divisors: Floats) -> float:
    both = np.isfinite(numbers) & np.isfinite(divisors) & (numbers != 0) & (divisors != 0)
    return float(np.median(np.abs(numbers[both] / divisors[both]))) if np.any(both) else nan
