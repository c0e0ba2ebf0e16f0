"""Sentences of a page on harmonics and their limits."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from centering.roundness._harmonic_limits import limits_of
from centering.roundness._harmonics import Harmonics
from sdpgrind.base.units import UM

_SURE = 1.96  # derived: standard deviations to both ends of a 95 % interval of a normal amplitude


def split_limits(limits: Mapping[Any, float] | None) -> tuple[dict[str, float], dict[Any, float]]:
    """Limits of parameters by name, and those of harmonics."""
    given = dict(limits or {})
    waves = {upr: given.pop(upr) for upr in list(given) if not isinstance(upr, str)}
    return given, waves


def measured_for(profile: Any, limits: Mapping[Any, float]) -> Harmonics | None:
    """Harmonics of a profile up to the highest of the limits (mm), with these; None without limits."""
    if not limits:
        return None
    highest = max(high for _, high, _ in limits_of("limits", limits))
    found: Harmonics = profile.harmonics(highest, limits=limits)
    return found


def harmonic_verdicts(found: Harmonics | None) -> list[str]:
    """Return whether harmonics keep their limits (mm), a sentence for each limit."""
    return [] if found is None else [_verdict(found, *limit) for limit in found.limits]


def _verdict(found: Harmonics, low: int, high: int, most: float) -> str:
    """Sentence on the harmonic of a band that is nearest to the limit or farthest above it."""
    within = np.flatnonzero((found.upr >= low) & (found.upr <= high))
    worst = within[np.argmax(found.amplitude[within])]
    size, sd = float(found.amplitude[worst]), _SURE * float(found.sd[worst])
    above = int(np.sum(found.amplitude[within] > most))
    others = f", {above} above it" if above > 1 else ""
    band = f"{low} to {high} upr: largest amplitude at {found.upr[worst]:g} upr"
    name = band if high > low else f"{low} upr: amplitude"
    kept = "kept" if size + sd <= most else "exceeded" if size - sd > most else "not decided"
    return f"{name} {UM * size:.4g} ± {UM * sd:.2g} µm (95 %), limit {UM * most:.4g} µm{others}: {kept}"
