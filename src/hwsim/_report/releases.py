"""Whether a run kept its clock: releases that were missed, and how late the latest step began."""

from typing import Any

import numpy as np

_MS = 1e3  # derived: ms a second


def missed_releases(log: Any) -> str:
    """Return how many releases of a run against the clock were missed, in words; "": none."""
    tables = [log[tier] for tier in log.tiers if "overrun" in log[tier]]
    missed = sum(int(np.nansum(each.overrun.values)) for each in tables)
    if not missed:
        return ""
    steps = sum(int(np.isfinite(each.overrun.values).sum()) for each in tables)
    latest = max(float(np.nanmax(each.release_delay.values, initial=0.0)) for each in tables)
    told = f"the latest step began {_MS * latest:.0f} ms after its release"
    return f"{missed} of {missed + steps} releases missed; {told}"
