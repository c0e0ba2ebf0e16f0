"""Trace of a push on a turning table, exact between its events, along the contact normal."""

import dataclasses
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from centering.push._contact.reaction import Pushable, parameter_rows, refuse_unfinished
from centering.push._contact.reaction_kernels import COLUMNS
from centering.push._contact.trace import PushTrace, traced
from centering.push.turning._table_kernels import loaded_push, loaded_pushes, loaded_sample
from centering.push.turning._table_profile import TableProfile
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class TablePushTrace(PushTrace):
    """Simulated push on a turning table; `Push.simulate` and `simulate_table_push` make it.

    Positions are along the contact normal, over the table; slip across it is left out.

    Parameters
    ----------
    profile : TableProfile
        Motion of the tip against the table, and loads on friction.
    parameters, phases, summary : array
        As in `PushTrace`; friction without loads.

    Examples
    --------
    >>> from centering import TipProfile, preset
    >>> from centering.push.turning import turning_profile
    >>> model, push = preset("printed").model, TipProfile.move(1.0, 10.0, 2560.0)  # mm, mm/s, mm/s^2
    >>> turning = turning_profile(push, model, offset=1.0, touch_angle=0.1, spindle_speed=2.0)
    >>> trace = simulate_table_push(model, turning)
    >>> round(trace.peak_force, 1), trace.energy_balance < 1e-9  # N
    (70.4, True)
    """

    kind = "centering.table_push_trace"
    profile: TableProfile
    _rests: ClassVar[str] = "slides over the table by"

    def _states(self, times: Floats) -> Floats:
        out = np.empty((times.size, 4))
        loaded_sample(self.parameters, self.profile.pieces, self.phases, times, out)
        return out


def simulate_table_push(model: "Pushable | npt.ArrayLike", profile: TableProfile) -> TablePushTrace:
    """Simulate a push on a turning table along the contact normal, with exact events.

    Parameters
    ----------
    model : PushModel or array, (6,)
        See `simulate_push`.
    profile : TableProfile
        Motion of the tip (mm, s), see `turning_profile`.

    Raises
    ------
    ValueError
        When a parameter is out of range or the push has more than 200 000 phases.

    Examples
    --------
    >>> from centering import preset
    >>> model = preset("printed").model
    >>> loaded = TableProfile([0.4], [10.0], [0.0], held=[3.0], slid=[3.0])
    >>> round(simulate_table_push(model, loaded).peak_force, 2)  # N; 69.6 without loads
    72.6
    """
    law = parameter_rows(model)[0]
    pieces = checks.kind("profile", profile, TableProfile).pieces
    return TablePushTrace(profile, law, *traced(loaded_push, law, pieces, profile.start))


def simulate_table_pushes(parameters: Floats, profile: TableProfile) -> Floats:
    """Simulate a push with each of (m, 6) parameters; results as of `pushed`, FORCE, (m, 8)."""
    out, status = np.empty((len(parameters), COLUMNS)), np.empty(len(parameters), dtype=np.int64)
    loaded_pushes(parameters, profile.pieces, profile.start, out, status)
    refuse_unfinished(status)
    return out
