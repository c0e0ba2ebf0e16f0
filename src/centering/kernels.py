"""Compiled physics of the simulated centering machine and of the probe, for the plants of other packages.

`machine` steps table, tip and ring, `slide` carriage and spindle; `ring` holds the laws of a ring that
sticks, slides or is thrown, `gauges` the measurements, `probe` the readings of a measuring head. Kernels are
serial and work on plain arrays, in place.
"""

from centering._plant import kernels as machine
from centering._plant import measure_kernels as gauges
from centering._plant import probe_kernels as probe
from centering._plant import ring_kernels as ring
from centering._plant import slide_kernels as slide

__all__ = ["gauges", "machine", "probe", "ring", "slide"]
