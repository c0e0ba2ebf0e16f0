"""Frequency of stick and slip: from a trace, over the push speed; the contact stiffness that it implies."""

from collections.abc import Sequence
from math import nan, pi
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from centering._problem.model import PushModel
from centering.push._contact.trace import PushTrace, simulate_push
from centering.push._profile.profile import TipProfile
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

_LOWEST = 4.0  # Hz, chosen: rise and drift of the force lie below
_SAMPLES = 8001  # chosen: samples of a simulated push; fewer blur its peaks
_PADDING = 16  # chosen: length of the padded series over its own; a parabola finds the top between lines
_PROMINENCE = 0.2  # chosen: share of the range of the force; smaller peaks are ripple
_EVEN = 1e-6  # chosen: relative difference of time steps, far above rounding of recorded times


class StictionResonance(NamedTuple):
    """Frequency of a contact force, estimated in two ways.

    Attributes
    ----------
    line, spacing : float
        Highest line of the spectrum above 4 Hz, and reciprocal of the mean time (s) between peaks, Hz (1/s);
        NaN with fewer than two peaks. Where both differ much, the force is no steady oscillation.
    peaks : int
        Number of peaks.
    """

    line: float
    spacing: float
    peaks: int


def stiction_resonance(trace: PushTrace | xr.Dataset) -> StictionResonance:
    """Return the frequency at which the contact force of a push oscillates.

    The spectrum is that of the force without its mean, padded with zeros: a push of 0.2 s alone has lines 5
    Hz apart.

    Parameters
    ----------
    trace : PushTrace or Dataset
        Simulated push, or recorded one with `contact_force` (N) over an even `time` (s).

    Raises
    ------
    TypeError
        When it is neither.
    ValueError
        When there are fewer than 16 samples, they are not evenly spaced, or the force is constant.

    Examples
    --------
    >>> from centering import preset
    >>> model = preset("printed").model
    >>> found = stiction_resonance(simulate_push(model, TipProfile.constant_speed(10.0, 0.2)))  # mm/s, s
    >>> round(found.line, 1), round(found.spacing, 1)  # Hz; undamped sqrt(k/M)/(2 pi) is 40.1
    (39.7, 39.8)
    """
    time, force = _record(trace)
    if np.ptp(force) <= 0.0:
        raise checks.refuse("contact_force", "changing", float(force[0]), "N")
    step = float(time[-1] - time[0]) / (time.size - 1)
    tops = _peaks(force)
    lasting = (tops[-1] - tops[0]) * step if tops.size > 1 else nan
    return StictionResonance(_line(force, step), float((tops.size - 1) / lasting), int(tops.size))


def resonance_over_speed(
    model: PushModel, speeds: Sequence[float] | Floats, *, duration: float = 0.2
) -> tuple[StictionResonance, ...]:
    """Return the resonance of pushes at constant speeds.

    It is independent of the speed while the part keeps contact. A part that bounces has periods longer by the
    flight 2 (v_0 - v)/(mu_k g), so that the frequency falls with rising speed; at low speeds the sticking
    time lowers it too.

    Parameters
    ----------
    model : PushModel
        Model of part and contact.
    speeds : sequence of float
        Push speeds, mm/s.
    duration : float
        Duration of each push from first touch on, s.

    Raises
    ------
    ValueError
        When a speed or the duration is not > 0.

    Examples
    --------
    >>> from centering import preset
    >>> found = resonance_over_speed(preset("printed").model, [5.0, 10.0, 100.0 / 3.0])  # mm/s
    >>> [round(each.spacing) for each in found]  # Hz
    [40, 40, 32]
    """
    checks.kind("model", model, PushModel)
    return tuple(
        stiction_resonance(simulate_push(model, TipProfile.constant_speed(v, duration))) for v in speeds
    )


def implied_stiffness(frequency: float, *, mass: float, damping: float = 0.0) -> float:
    """Return the contact stiffness from a resonance without bouncing, N/mm: k = M (2 pi f)^2 + B^2/(4 M).

    Parameters
    ----------
    frequency : float
        Resonance, Hz (1/s).
    mass : float
        Mass of the part, kg.
    damping : float
        B = b + k_v, N s/mm; it lowers the frequency of a light part clearly.

    Raises
    ------
    ValueError
        When frequency or mass is not > 0, or the damping is < 0.

    Examples
    --------
    >>> [round(implied_stiffness(f, mass=18.9)) for f in (29.9, 27.8)]  # N/mm
    [667, 577]
    >>> round(implied_stiffness(51.0, mass=0.8))
    82
    """
    f, inertia = checks.positive("frequency", frequency, "Hz"), checks.positive("mass", mass, "kg") / 1000.0
    b = checks.nonnegative("damping", damping, "N s/mm")
    return inertia * (2.0 * pi * f) ** 2 + b * b / (4.0 * inertia)


def _record(trace: Any) -> tuple[Floats, Floats]:
    """Evenly spaced times (s) and the force at them (N)."""
    if isinstance(trace, PushTrace):
        time = np.linspace(0.0, trace.duration, _SAMPLES)
        return time, trace.at(time).contact_force.values
    data = checks.kind("trace", trace, xr.Dataset, " or a PushTrace")
    time = checks.finite_array("time", data["time"].values, "s")
    force = checks.finite_array("contact_force", data["contact_force"].values, "N")
    if time.ndim != 1 or time.size < _PADDING or time.shape != force.shape:
        raise checks.refuse(
            "time and contact_force", f"of one length >= {_PADDING}", (time.shape, force.shape)
        )
    steps = np.diff(time)
    if steps[0] <= 0.0 or np.ptp(steps) > _EVEN * steps[0]:
        raise checks.refuse("time", "evenly spaced and increasing", time, "s")
    return time, force


def _line(force: Floats, step: float) -> float:
    """Frequency of the highest line, Hz."""
    length = 1 << (_PADDING * force.size - 1).bit_length()
    size = np.abs(np.fft.rfft(force - force.mean(), length))
    first = int(np.ceil(_LOWEST * length * step))
    top = first + int(size[first:-1].argmax())
    before, at, after = size[top - 1 : top + 2]
    return float(top + 0.5 * (before - after) / (before - 2.0 * at + after)) / (length * step)


def _peaks(force: Floats) -> Floats:
    """Positions of the peaks in samples, each from the parabola through its three highest samples."""
    from scipy import signal  # only who looks for a resonance pays for it

    tops = signal.find_peaks(force, prominence=_PROMINENCE * np.ptp(force))[0]
    before, at, after = force[tops - 1], force[tops], force[tops + 1]
    bend = before - 2.0 * at + after
    return np.asarray(
        tops + np.where(bend < 0.0, 0.5 * (before - after) / np.where(bend < 0.0, bend, -1.0), 0.0)
    )
