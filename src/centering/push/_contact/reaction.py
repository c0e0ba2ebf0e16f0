"""Simulation of many pushes: final position, free slide, peak force and more of each."""

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from centering.push._contact.reaction_kernels import (
    COLUMNS,
    DONE,
    EVENTS_MAX,
    TOO_MANY,
    WORK,
    push_many,
)
from centering.push._profile.profile import TipProfile
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

_NAMES = ("M", "k", "b", "F_s", "F_k", "k_v")
_UNITS = ("N s^2/mm", "N/mm", "N s/mm", "N", "N", "N s/mm")

COLUMN_NAMES = (
    "final_position",
    "free_slide",
    "peak_force",
    "time",
    "events",
    "energy_error",
    "breakaway_time",
    "final_speed",
)
"""Columns of the result of `simulate_pushes`."""


class Pushable(Protocol):
    """Anything with the `parameters` of a push."""

    @property
    def parameters(self) -> Floats:
        """M (N s^2/mm), k (N/mm), b (N s/mm), F_s (N), F_k (N) and k_v (N s/mm), (6,)."""


def simulate_pushes(
    parameters: "npt.ArrayLike | Pushable | Sequence[Pushable]", profiles: "TipProfile | Sequence[TipProfile]"
) -> Floats:
    """Simulate many pushes of the reaction model, Mears (5.26) and (5.27), with exact events.

    Parameters
    ----------
    parameters : array, (m, 6) or (6,), or one or several PushModel
        `PushModel.parameters` of each push, or of all.
    profiles : TipProfile or sequence of m of them
        Motion of the tip in each push, or in all.

    Returns
    -------
    array, (m, 8)
        Final position of the part (mm from its first place), longest free slide (mm), peak force (N), time
        until the part rests or the profile ends (s), number of phases, relative residual of the energy
        balance, time of breakaway (s; NaN: never), final speed (mm/s; 0 unless the tip advances at the end).

    Raises
    ------
    ValueError
        When a parameter is out of range, the numbers of parameters and profiles differ, or a push has more
        than 200 000 phases.

    Examples
    --------
    >>> import numpy as np
    >>> parameters = np.array([0.0189, 1200.0, 1.0, 37.07, 27.803, 0.1])
    >>> speeds = (10.0, 50.0 / 3.0, 100.0 / 3.0)  # mm/s
    >>> table = simulate_pushes(parameters, [TipProfile.constant_speed(speed, 0.4) for speed in speeds])
    >>> table[:, 2].round(2), (1000 * table[:, 1]).round(1)  # N, µm
    (array([ 69.6 ,  96.64, 164.78]), array([  0. , 193.8, 859.9]))
    """
    return pushed(parameters, profiles, WORK)


def pushed(parameters: Any, profiles: "TipProfile | Sequence[TipProfile]", asked: int) -> Floats:
    """Return the table of `simulate_pushes`, its peak force and energy balance only where `asked` for."""
    rows = parameter_rows(parameters)
    listed = [profiles] if isinstance(profiles, TipProfile) else list(profiles)
    for profile in listed:
        checks.kind("profiles", profile, TipProfile)
    m = max(len(listed), len(rows))
    if len(rows) not in (1, m) or len(listed) not in (1, m):
        raise checks.refuse(
            "parameters and profiles", "of one number, or one of either", (len(rows), len(listed))
        )
    segments = np.concatenate([profile.segments for profile in listed])
    ends = np.cumsum([profile.duration.size for profile in listed])
    starts = np.array([profile.start for profile in listed])
    out, status = np.empty((m, COLUMNS)), np.empty(m, dtype=np.int64)
    push_many(rows, segments, ends, starts, out, status, asked)
    refuse_unfinished(status)
    return out


def parameter_rows(parameters: Any) -> Floats:
    """Check parameters of pushes; (m, 6)."""
    if isinstance(parameters, Sequence) and parameters and hasattr(parameters[0], "parameters"):
        parameters = [model.parameters for model in parameters]
    rows = np.atleast_2d(checks.finite_array("parameters", getattr(parameters, "parameters", parameters)))
    if rows.ndim != 2 or rows.shape[1] != len(_NAMES) or rows.shape[0] == 0:
        raise checks.refuse("parameters", "of shape (m, 6): M, k, b, F_s, F_k, k_v", rows.shape)
    for j, (name, unit) in enumerate(zip(_NAMES, _UNITS, strict=True)):
        least = rows[:, j].min()
        if least < 0.0 or (least == 0.0 and name not in ("b", "k_v")):
            raise checks.refuse(
                f"parameters[:, {j}], {name},", ">= 0" if name in ("b", "k_v") else "> 0", float(least), unit
            )
    if np.any(rows[:, 3] < rows[:, 4]):
        raise checks.refuse("parameters[:, 3], F_s,", ">= F_k", rows[rows[:, 3] < rows[:, 4]][0], "N")
    return np.ascontiguousarray(rows)


def refuse_unfinished(status: Any) -> None:
    """Raise unless every push has come to its end."""
    bad = np.flatnonzero(status != DONE)
    if bad.size == 0:
        return
    if status[bad[0]] == TOO_MANY:
        raise ValueError(
            f"a push must have at most {EVENTS_MAX} phases; push {bad[0]} has more: make it shorter or"
            " faster, its jumps are 2 (F_s - F_k)/k long"
        )
    raise ValueError(
        f"a push must advance in time; push {bad[0]} changes its mode without end at one instant"
    )
