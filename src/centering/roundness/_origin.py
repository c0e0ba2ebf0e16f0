"""The origin of a profile: the steps that made it and their results, kept in files."""

import dataclasses
from math import inf
from typing import Protocol

import numpy as np

from centering.circle._fit.estimate import CircleEstimate
from centering.roundness._form import Form
from centering.roundness._roller import RollerError
from centering.roundness._sampling import widest_gap
from sdpgrind.base.checks import Floats
from sdpgrind.base.stored import stored


@stored("centering.profile_origin")
@dataclasses.dataclass(frozen=True)
class Origin:
    """Steps (sentences), runout, filter, sd of harmonics from 0 on (mm), noise (mm), Nyquist limit (upr).

    `low`, `high`: lower cut-off of a band or a high pass, upr; 1 where all pass; the least higher cut-off;
    inf. `spindle_sd`: sd of the harmonics of a spindle's error that was taken off, from 0 on, mm;
    `separated`: that share of `sd` after a filter or a separation; `lost`: harmonics that were not told
    apart, upr.

    `radius_known`: False where deviations count from the tester's own circle and the radius was assumed.

    `removed`: spindle angle (rad), reading and height above the form (mm) of asperities that were taken out.

    `suspects`: readings that look like asperities, counted before a filter; -1: not looked for.

    `hidden`: why the noise cannot be known from the readings, looked at before a filter; "": it can.

    `stuck`: sentence on equal readings in a row, looked for before a filter; "": there are none.

    `unlike`: sentence on turns that do not repeat, looked for before a filter; "": they do.

    `disagreement`: sentence on steps of a separation that do not agree; empty where they do.

    `noise_given`: whether `noise_sd` was given by the user.

    ``source`` is the JSON of the `Source` of a profile that was read, else empty; equal readings make equal
    profiles, wherever they come from.
    """

    steps: tuple[str, ...] = ()
    runout: RollerError | None = None
    filter: str = ""
    sd: tuple[float, ...] = ()
    noise_sd: float | None = None
    nyquist: float = 0.0
    low: float = 1.0
    spindle_sd: tuple[float, ...] = ()
    radius_known: bool = True
    removed: tuple[tuple[float, ...], ...] = ()
    high: float = inf
    separated: tuple[float, ...] = ()
    lost: tuple[int, ...] = ()
    noise_given: bool = False
    suspects: int = -1
    hidden: str | None = None
    stuck: str | None = None
    unlike: str | None = None
    disagreement: str = ""
    source: str = dataclasses.field(default="", compare=False)


MEASURED = Origin()


class Kept(Protocol):
    """What has an origin."""

    @property
    def _origin(self) -> Origin: ...


def refuse_late(profile: Kept, name: str) -> None:
    """Refuse a step of this name for a profile that has lost its readings."""
    origin = profile._origin
    if origin.filter or origin.sd:
        done = origin.filter or origin.steps[-1]
        raise ValueError(f"{name} must come before a filter or a separation; got {done}")


_UNEVEN = 2.0  # chosen: sd in a gap over the median sd from which a step mentions the gap


@dataclasses.dataclass(frozen=True)
class Made:
    """Result of a step: samples of the same ring, origin, residuals, flag of a bore, sd of samples (mm)."""

    angle: Floats
    reading: Floats
    tip_radius: float
    circle: CircleEstimate
    origin: Origin
    left: Floats | None
    internal: bool
    sd: Floats | None = None


def runout_sentence(runout: RollerError) -> str:
    """Sentence on a runout."""
    amplitude = f"{1e3 * runout.amplitude:.4g} ± {1e3 * runout.amplitude_sd:.2g} µm"
    size = f"roller runout of {amplitude} at {runout.ratio:.6g} upr"
    if not runout.seen:
        return (
            f"{size} is not told from noise: the readings are left as they are"
            f" (condition {runout.condition:.3g})"
        )
    slipped = f"; the roller slipped by {runout.slip:.2g} mm" if runout.slipped else ""
    return (
        f"{size} removed, fitted with {runout.upr_max} harmonics over {runout.turns:.3g} turns,"
        f" condition {runout.condition:.3g}{slipped}"
    )


def remarks_on(origin: Origin) -> tuple[str, ...]:
    """Sentences on steps or turns that do not agree, and on readings as of asperities or a stuck probe."""
    told = origin.disagreement, origin.stuck, origin.unlike
    return (*filter(None, told), *_suspect_sentence(origin))


def _suspect_sentence(origin: Origin) -> tuple[str, ...]:
    """Sentence on readings that look like asperities; none where there are none."""
    if origin.suspects <= 0:
        return ()
    if origin.suspects == 1:
        return ("1 reading looks like an asperity; profile.remove_asperities() takes it out",)
    return (f"{origin.suspects} readings look like asperities; profile.remove_asperities() takes them out",)


def form_sentence(form: Form) -> str:
    """Sentence on the harmonics of a filter."""
    fit = form.fit
    samples = f"{fit.residual.size} samples, condition {fit.condition:.3g}"
    return f"{form.coef.size - 1} harmonics by least squares of {samples}"


def gap_sentence(sd: Floats, part_angle: Floats) -> str:
    """Sentence on a gap where the filtered form is less certain than elsewhere; else ""."""
    usual, worst = float(np.median(sd)), float(sd.max())
    if not worst > _UNEVEN * usual:
        return ""
    return (
        f"a gap of {np.degrees(widest_gap(part_angle)):.3g} degrees is bridged, not measured:"
        f" the form there is known to ± {1e3 * worst:.2g} µm (sd), elsewhere to ± {1e3 * usual:.2g} µm"
    )


def sd_of_harmonics(sd: Floats) -> float:
    """Standard deviation of one deviation from those of its harmonics, mm."""
    return float(np.sqrt(np.sum(sd**2)))
