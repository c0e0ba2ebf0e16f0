"""Limits of a page: of parameters by name, of harmonics by upr."""

from collections.abc import Mapping
from typing import Any

from centering.roundness._harmonic_limits import limits_of
from centering.roundness._harmonics import Harmonics


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
    return [] if found is None else [str(each) for each in found.decisions]
