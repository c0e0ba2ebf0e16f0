"""Trace of a push: phases, motion of tip and part, contact force; drawn, labelled, saved."""

import dataclasses
from functools import cached_property
from math import pi, sqrt
from typing import Any, ClassVar, Self

import numpy as np
import numpy.typing as npt
import xarray as xr

from centering.push._contact.reaction import COLUMN_NAMES, Pushable, parameter_rows, refuse_unfinished
from centering.push._contact.reaction_kernels import COLUMNS, EVENTS, LOG_COLUMNS, TRAVEL, WORK, push
from centering.push._contact.sample_kernels import sample
from centering.push._profile.profile import TipProfile
from sdpgrind.base import checks, pictures, stored
from sdpgrind.base.arrays import ByValue, lasting
from sdpgrind.base.checks import Floats
from sdpgrind.base.plans import Plan

MODES = ("rest", "stick", "slip", "free")
"""Names of the modes by number."""
_PER_PERIOD = 60  # chosen: samples per period of the part on the contact; fewer show corners
_SAMPLES = (400, 20_001)  # chosen: fewest and most; beyond, pictures show nothing new
PHASES_TOLD = "time, mode, tip position, speed and acceleration, gap, part speed at begins (s, mm)"
PARAMETERS_TOLD = "M (N s^2/mm), k (N/mm), b (N s/mm), F_s (N), F_k (N), k_v (N s/mm)"
_LABELS = {
    "tip_position": ("mm", "position of the pusher tip from first touch"),
    "part_position": ("mm", "position of the part from where it lay"),
    "part_velocity": ("mm/s", "speed of the part"),
    "contact_force": ("N", "force of the tip on the part"),
}


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class PushTrace(ByValue, Plan):
    """Simulated push, exact between its events; `simulate_push` makes it.

    Parameters
    ----------
    profile : TipProfile
        Motion of the tip.
    parameters : array, (6,)
        `PushModel.parameters` of the push.
    phases : array, (n + 1, 7)
        State at the beginning of each phase and at the end: time (s), mode (0 to 3: rest, stick, slip, free),
        tip position (mm), tip speed (mm/s), tip acceleration (mm/s^2), tip minus part position (mm), part
        speed (mm/s).
    summary : array, (8,)
        Row of `simulate_pushes`.

    Examples
    --------
    >>> from centering import preset
    >>> trace = simulate_push(preset("printed").model, TipProfile.constant_speed(100.0 / 3.0, 0.4))  # mm/s, s
    >>> round(trace.peak_force, 2), round(1000 * trace.free_slide, 1), trace.energy_balance < 1e-9  # N, µm
    (164.78, 859.9, True)
    >>> trace.event_mode[:4]
    ('stick', 'slip', 'free', 'slip')
    """

    kind = "centering.push_trace"
    profile: TipProfile
    parameters: Floats
    phases: Floats
    summary: Floats
    _rests: ClassVar[str] = "rests at"

    def __post_init__(self) -> None:
        for name in ("parameters", "phases", "summary"):
            object.__setattr__(self, name, lasting(getattr(self, name)))

    @property
    def final_position(self) -> float:
        """Position of the part at the end, mm from its first place."""
        return float(self.summary[0])

    @property
    def free_slide(self) -> float:
        """Longest travel between loss of contact and the next contact or rest, mm."""
        return float(self.summary[1])

    @property
    def peak_force(self) -> float:
        """Greatest contact force, N."""
        return float(self.summary[2])

    @property
    def duration(self) -> float:
        """Time until the part rests or the profile ends, the later of the two, s."""
        return float(self.summary[3])

    @property
    def energy_balance(self) -> float:
        """Residual of the energy balance, by quadrature of force times speed, dimensionless.

        Work of the contact less work of friction less kinetic energy left, over the work of the contact plus
        the energy stored in the contact at breakaway.
        """
        return float(self.summary[5])

    @property
    def breakaway_time(self) -> float:
        """Time at which the part first slips, s; NaN: never."""
        return float(self.summary[6])

    @property
    def final_velocity(self) -> float:
        """Speed of the part at the end, mm/s; 0 unless the profile ends while the tip advances."""
        return float(self.summary[7])

    @property
    def event_time(self) -> Floats:
        """Beginning of each phase, (n,), s."""
        return self.phases[:-1, 0]

    @property
    def event_mode(self) -> tuple[str, ...]:
        """Mode of each phase (unit 1): at rest ``rest``, touching ``stick``; moving ``free`` or ``slip``."""
        return tuple(MODES[int(mode)] for mode in self.phases[:-1, 1])

    @cached_property
    def time(self) -> Floats:
        """Even times of the samples, (m,), s: 60 per period of the part on the contact, 400 to 20 001."""
        period = 2.0 * pi * sqrt(self.parameters[0] / self.parameters[1])
        wanted = _PER_PERIOD * self.duration / period
        return lasting(np.linspace(0.0, self.duration, int(np.clip(wanted, *_SAMPLES))))

    @property
    def tip_position(self) -> Floats:
        """Of the samples, (m,), mm."""
        return self._samples[:, 0]

    @property
    def part_position(self) -> Floats:
        """Of the samples, (m,), mm."""
        return self._samples[:, 1]

    @property
    def part_velocity(self) -> Floats:
        """Of the samples, (m,), mm/s."""
        return self._samples[:, 2]

    @property
    def contact_force(self) -> Floats:
        """Of the samples, (m,), N."""
        return self._samples[:, 3]

    @cached_property
    def _samples(self) -> Floats:
        return lasting(self._states(self.time))

    def at(self, time: npt.ArrayLike) -> xr.Dataset:
        """Return tip and part position (mm), part speed (mm/s) and contact force (N), exactly.

        Parameters
        ----------
        time : array, (m,)
            Times, s, increasing, from 0 to `duration`.

        Raises
        ------
        ValueError
            When the times do not increase or lie outside.

        Examples
        --------
        >>> from centering import preset
        >>> trace = simulate_push(preset("printed").model, TipProfile.constant_speed(10.0, 0.4))  # mm/s, s
        >>> float(trace.at([0.001]).contact_force[0])  # N: k v t + b v
        22.0
        """
        times = np.atleast_1d(checks.finite_array("time", time, "s"))
        if np.any(np.diff(times) < 0.0) or times[0] < 0.0 or times[-1] > self.duration:
            raise checks.refuse("time", f"increasing, in [0, {self.duration:g}]", times, "s")
        return self._labelled(times, self._states(times))

    def _states(self, times: Floats) -> Floats:
        out = np.empty((times.size, 4))
        sample(self.parameters, self.phases, times, out)
        return out

    @staticmethod
    def _labelled(times: Floats, states: Floats) -> xr.Dataset:
        """Label samples with names and units."""
        columns = {}
        for j, (name, (unit, told)) in enumerate(_LABELS.items()):
            columns[name] = ("time", states[:, j], {"units": unit, "long_name": told})
        return xr.Dataset(
            columns,
            {"time": ("time", times, {"units": "s", "long_name": "time from the begin of the profile"})},
        )

    @property
    def dataset(self) -> xr.Dataset:
        """Samples and phases with units and names; profile and parameters as JSON."""
        data = self._labelled(self.time, self._samples)
        data["phases"] = (("phase", "state"), self.phases)
        data["phases"].attrs["long_name"] = PHASES_TOLD
        data["summary"] = ("result", self.summary)
        data["summary"].attrs["long_name"] = ", ".join(COLUMN_NAMES)
        told = {"profile": stored.encode(self.profile), "parameters": stored.encode(self.parameters)}
        return data.assign_attrs(told)

    @classmethod
    def restored(cls, dataset: xr.Dataset) -> Self:
        profile, parameters = (stored.decode(dataset.attrs[name]) for name in ("profile", "parameters"))
        return cls(profile, np.array(parameters), dataset["phases"].values, dataset["summary"].values)

    def plot(self) -> Any:
        """Draw tip and part (mm) and the contact force (N) over time (s); return the figure."""
        return pictures.drawn("centering.push._contact.trace_picture:plot_trace", self)

    def _told(self) -> str:
        moved = f"part moved {self.final_position:.4g} mm, peak {self.peak_force:.4g} N"
        slid = f"slide {1e3 * self.free_slide:.4g} µm, {len(self.event_mode)} phases in {self.duration:.4g} s"
        return f"{moved}, {slid}"


def simulate_push(model: "Pushable | npt.ArrayLike", profile: TipProfile) -> PushTrace:
    """Simulate a push of the reaction model, Mears (5.26) and (5.27), with exact events.

    After the profile a tip that does not advance keeps its speed until the part rests; a tip that advances
    ends the push.

    Parameters
    ----------
    model : PushModel or array, (6,)
        Part, contact and friction, or `PushModel.parameters`.
    profile : TipProfile
        Motion of the tip (mm, s).

    Raises
    ------
    ValueError
        When a parameter is out of range or the push has more than 200 000 phases.

    Examples
    --------
    >>> import numpy as np
    >>> parameters = np.array([0.0189, 1200.0, 1.0, 37.07, 27.803, 0.1])
    >>> trace = simulate_push(parameters, TipProfile.move(5.0, 40.0, 2560.0))
    >>> round(trace.final_position, 3), round(trace.peak_force, 1)  # mm, N
    (5.282, 131.4)
    """
    law = parameter_rows(model)[0]
    checks.kind("profile", profile, TipProfile)
    return PushTrace(profile, law, *traced(push, law, profile.segments, profile.start))


def traced(kernel: Any, law: Floats, rows: Floats, start: float) -> tuple[Floats, Floats]:
    """Phases and summary of a push; the first run of the kernel counts the phases."""
    summary, nothing = np.empty(COLUMNS), np.empty((0, LOG_COLUMNS))
    refuse_unfinished(np.array([kernel(law, rows, start, summary, nothing, TRAVEL)]))
    phases = np.empty((int(summary[EVENTS]) + 1, LOG_COLUMNS))
    kernel(law, rows, start, summary, phases, WORK)
    return phases, summary
