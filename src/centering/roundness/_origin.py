"""How a profile came about, so that every step can build on the last and a file can tell."""

import dataclasses

import numpy as np

from centering.circle._fit.estimate import CircleEstimate
from centering.roundness._form import Form
from centering.roundness._runout import Runout
from centering.roundness._sampling import widest_gap
from sdpgrind.base.checks import Floats
from sdpgrind.base.stored import stored


@stored("centering.profile_origin")
@dataclasses.dataclass(frozen=True)
class Origin:
    """What steps have found: sentences, runout, filter, sd of the harmonics from 0 on (mm), noise (mm), Nyquist's limit (upr)."""

    steps: tuple[str, ...] = ()
    runout: Runout | None = None
    filter: str = ""
    sd: tuple[float, ...] = ()
    noise_sd: float | None = None
    nyquist: float = 0.0


MEASURED = Origin()

_UNEVEN = 2.0  # times the usual sd: a gap that is told


@dataclasses.dataclass(frozen=True)
class Made:
    """What a step makes: samples of the same ring, how, what is left of each that went in; a bore? sd of each deviation."""

    angle: Floats
    reading: Floats
    tip_radius: float
    circle: CircleEstimate
    origin: Origin
    left: Floats | None
    internal: bool
    sd: Floats | None = None


def told_runout(runout: Runout) -> str:
    """The sentence on a runout."""
    if not runout.seen:
        return (
            f"roller runout of {1e3 * runout.amplitude:.4g} ± {1e3 * runout.amplitude_sd:.2g} µm at {runout.ratio:.6g} upr is not"
            f" told from noise: the readings are left as they are (condition {runout.condition:.3g})"
        )
    slipped = f"; the roller slipped by {runout.slip:.2g} mm" if runout.slipped else ""
    return (
        f"roller runout of {1e3 * runout.amplitude:.4g} ± {1e3 * runout.amplitude_sd:.2g} µm at {runout.ratio:.6g} upr removed,"
        f" fitted with {runout.upr_max} harmonics over {runout.turns:.3g} turns, condition {runout.condition:.3g}{slipped}"
    )


def told_form(form: Form) -> str:
    """How the harmonics of a filter came about."""
    fit = form.fit
    return f"{form.coef.size - 1} harmonics by least squares of {fit.residual.size} samples, condition {fit.condition:.3g}"


def told_gap(sd: Floats, part_angle: Floats) -> str:
    """What a filter makes of a gap, where it is less sure there than elsewhere; else nothing."""
    usual, worst = float(np.median(sd)), float(sd.max())
    if not worst > _UNEVEN * usual:
        return ""
    return (
        f"a gap of {np.degrees(widest_gap(part_angle)):.3g} degrees is bridged, not measured: the form there is known to"
        f" ± {1e3 * worst:.2g} µm (sd), elsewhere to ± {1e3 * usual:.2g} µm"
    )


def scattered(sd: Floats) -> float:
    """Sd of one deviation from those of its harmonics, mm."""
    return float(np.sqrt(np.sum(sd**2)))
