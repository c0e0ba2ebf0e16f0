"""Planned pushes as labelled records: rows of the motion, values with units, the whole plan as JSON."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from centering.push._contact.reaction import COLUMN_NAMES
from centering.push._contact.trace import PARAMETERS_TOLD, PHASES_TOLD, PushTrace
from centering.push._profile.profile import TipProfile
from sdpgrind.base import checks
from sdpgrind.base.arrays import lasting
from sdpgrind.base.stored import decode, encode

_MOTION = {
    "duration": ("s", "duration of the segment"),
    "velocity": ("mm/s", "speed of the slide at its begin"),
    "acceleration": ("mm/s^2", "acceleration of the slide in it"),
}
_PLANNED = {
    "offset": "mm",
    "spindle_speed": "rad/s",
    "push_speed": "mm/s",
    "lead_angle": "rad",
    "turns": "1",
    "lead_distance": "mm",
    "rough": "mm",
    "fine": "mm",
    "stroke": "mm",
    "time": "s",
}
_FOUND = {"stop_error": "mm", "rest_time": "s", "least_force": "N"}


def push_dataset(push: Any, profile: TipProfile) -> xr.Dataset:
    """Motion and planned values of a `Push`, labelled; the whole push as JSON."""
    return _dataset(push, profile, _PLANNED).assign_attrs(push=encode(push))


def optimal_dataset(
    push: Any, profile: TipProfile, traces: tuple[PushTrace, ...], plain: Mapping[str, Any]
) -> xr.Dataset:
    """Motion, results and phases of an `OptimalPush` at every friction, labelled; `plain` as JSON."""
    data = _dataset(push, profile, {"distance": "mm"})
    data = data.assign_coords(
        friction=("friction", push.friction, {"units": "1", "long_name": "ratio to the problem's friction"})
    )
    for name, unit in _FOUND.items():
        data[name] = ("friction", getattr(push, name), {"units": unit, "long_name": name.replace("_", " ")})
    for name, column, told in (
        ("parameters", "parameter", PARAMETERS_TOLD),
        ("summary", "result", ", ".join(COLUMN_NAMES)),
    ):
        data[name] = (("friction", column), [getattr(trace, name) for trace in traces], {"long_name": told})
    data["phases"] = (("friction", "phase", "state"), _padded(traces), {"long_name": PHASES_TOLD})
    return data.assign_attrs(optimal_push=encode(plain))


def optimal_fields(data: xr.Dataset) -> dict[str, Any]:
    """Fields of a push from its `optimal_dataset`, the status by name."""
    plain = checks.kind("optimal_push", decode(data.attrs["optimal_push"]), dict)
    rows = (data[name].values for name in ("parameters", "phases", "summary"))
    traces = tuple(
        PushTrace(plain["profile"], parameters, phases[~np.isnan(phases[:, 0])], summary)
        for parameters, phases, summary in zip(*rows, strict=True)
    )
    return plain | {"friction": lasting(data["friction"].values), "traces": traces}


def _padded(traces: tuple[PushTrace, ...]) -> Any:
    """Phases of all traces, padded with NaN to the longest."""
    longest = max(len(trace.phases) for trace in traces)
    return [
        np.pad(each, ((0, longest - len(each)), (0, 0)), constant_values=math.nan)
        for each in (t.phases for t in traces)
    ]


def _dataset(plan: Any, profile: TipProfile, numbers: Mapping[str, str]) -> xr.Dataset:
    """Motion and named values of a plan, labelled."""
    motion = {
        name: ("segment", getattr(profile, name), {"units": u, "long_name": told})
        for name, (u, told) in _MOTION.items()
    }
    start = (
        (),
        profile.start,
        {"units": "mm", "long_name": "position of the slide at the start, from first touch"},
    )
    named = {
        n: ((), getattr(plan, n), {"units": unit, "long_name": n.replace("_", " ")})
        for n, unit in numbers.items()
    }
    return xr.Dataset(motion | {"start": start} | named)
