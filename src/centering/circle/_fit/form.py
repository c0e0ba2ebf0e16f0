"""Effect of a part's form on its fitted centre: over less than a turn, lobes look like an offset."""

from collections.abc import Mapping
from math import pi, sin
from typing import Any

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats


def form_gain(angle: npt.ArrayLike, upr: int) -> float:
    """Return the greatest error of the centre per amplitude of a lobe, mm/mm, over all phases of the lobe.

    Form of `upr` undulations and amplitude a shifts a least-squares centre by up to this gain times a,
    without any noise. Over less than a turn form limits an estimate, not the noise of the probe.

    Parameters
    ----------
    angle : array_like, shape (m,)
        Spindle angles of the readings, rad; at least 3 different ones.
    upr : int
        Undulations per revolution, at least 2.

    Returns
    -------
    float
        Gain, unit 1; about 0 for even full turns.

    Raises
    ------
    ValueError
        When the angles do not determine a circle, or `upr` is less than 2.

    Examples
    --------
    >>> round(form_gain(np.radians(np.arange(91)), 2), 2)
    3.48
    """
    theta = np.atleast_1d(checks.finite_array("angle", angle, "rad")).ravel()
    lobe = checks.count("upr", upr, 2)
    basis = np.column_stack([np.ones_like(theta), np.cos(theta), np.sin(theta)])
    lobes = np.column_stack([np.cos(lobe * theta), np.sin(lobe * theta)])
    shift, _, rank, _ = np.linalg.lstsq(basis, lobes, rcond=1e-11)
    if rank < 3:
        raise checks.refuse(
            "angle", "at least 3 different angles that determine a circle", int(np.unique(theta).size), "rad"
        )
    return float(np.linalg.norm(shift[1:], 2))


def gain_of_two(arc: float) -> float:
    """Gain of 2 upr over an evenly read arc of at least 0.1 rad, in closed form (its limit at 0 is 4)."""
    h = max(arc, 0.1) / 2
    one, two, three = sin(h), sin(2 * h), sin(3 * h) / 3
    even = 2 * (h * (one + three) - one * two) / (2 * h * (h + two / 2) - 4 * one**2) if h < pi else 0.0
    odd = (one - three) / (h - two / 2)
    return max(abs(even), abs(odd))


def assumed_lobes(form: Mapping[int, float] | None) -> Floats:
    """Undulations per revolution and amplitudes (mm) of an assumed form, shape (k, 2)."""
    if form is None:
        return np.zeros((0, 2))
    if not isinstance(form, Mapping):
        shown = checks.shown(form)
        raise TypeError(
            f"form must be a mapping of undulations per revolution to amplitudes (mm); got {shown}"
        )
    rows = [
        (checks.count("upr of form", n, 2), checks.nonnegative(f"form[{n}]", a, "mm"))
        for n, a in form.items()
    ]
    return np.array(rows, dtype=float).reshape(-1, 2)


def known_harmonics(harmonics: Any) -> Floats:
    """Undulations per revolution, cosine and sine (mm) of a known form, shape (k, 3), without zeros."""
    if harmonics is None:
        return np.zeros((0, 3))
    upr, amplitude, phase = _pairs(harmonics) if isinstance(harmonics, Mapping) else _arrays(harmonics)
    kept = amplitude != 0
    wrong = kept & ((upr < 2) | (upr != np.round(upr)))
    if wrong.any():
        raise checks.refuse("harmonics upr", "a whole number >= 2", float(upr[wrong][0]), "1")
    rows = np.column_stack([upr, amplitude * np.cos(phase), amplitude * np.sin(phase)])
    return np.ascontiguousarray(rows[kept])


def _pairs(harmonics: Mapping[Any, Any]) -> tuple[Floats, ...]:
    """Arrays of a mapping upr -> (amplitude, phase)."""
    upr = checks.finite_array("harmonics upr", list(harmonics), "1")
    try:
        pairs = checks.finite_array("harmonics", list(harmonics.values()), "mm, rad")
    except TypeError:
        pairs = np.empty(0)
    if upr.size and pairs.shape != (upr.size, 2):
        raise checks.refuse("harmonics", "upr -> (amplitude, phase)", harmonics, "mm, rad")
    return upr, *pairs.reshape(-1, 2).T


def _arrays(harmonics: Any) -> tuple[Floats, ...]:
    """Arrays of a spectrum."""
    names = {"upr": "1", "amplitude": "mm", "phase": "rad"}
    if not all(hasattr(harmonics, name) for name in names):
        raise TypeError(
            "harmonics must be a spectrum with upr, amplitude (mm) and phase (rad),"
            f" or upr -> (amplitude, phase); got {checks.shown(harmonics)}"
        )
    arrays = tuple(
        checks.finite_array(f"harmonics.{k}", getattr(harmonics, k), unit) for k, unit in names.items()
    )
    if any(array.shape != (arrays[0].size,) for array in arrays):
        raise ValueError(
            f"harmonics must hold arrays of one length; got shapes {[array.shape for array in arrays]}"
        )
    return arrays
