"""Physics of the simulated centering machine and of the probe, for the plants of other packages.

Modules of kernels on plain arrays, changed in place: `machine` steps table, tip and ring, `slide` carriage
and spindle, `ring` has the laws of a ring that sticks, slides or is thrown, `gauges` the sensors, `probe` the
readings of a measuring head. `Ring`, `ProbeErrors` and `ProbeScan` describe a ring and a probe;
`core_settings`, `gauge_settings`, `shape_of` and `lobes_of` give their arrays.
"""

from centering._plant import kernels as machine
from centering._plant import measure_kernels as gauges
from centering._plant import probe_kernels as probe
from centering._plant import ring_kernels as ring
from centering._plant import slide_kernels as slide
from centering._plant.probe import ProbeErrors, ProbeScan, probe_settings, probe_shape, probe_state
from centering._plant.ring import Ring, lobes_of, moved_by, shape_of, within_a_turn
from centering._plant.settings import checked_profile, core_settings, gauge_settings, lag_time

__all__ = [
    "ProbeErrors",
    "ProbeScan",
    "Ring",
    "checked_profile",
    "core_settings",
    "gauge_settings",
    "gauges",
    "lag_time",
    "lobes_of",
    "machine",
    "moved_by",
    "probe",
    "probe_settings",
    "probe_shape",
    "probe_state",
    "ring",
    "shape_of",
    "slide",
    "within_a_turn",
]
