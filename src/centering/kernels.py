"""Compiled physics of the simulated centering machine and of the probe, for the plants of other packages.

`machine` steps table, tip and ring, `slide` the carriage and the spindle, `ring` holds the laws of a ring that sticks,
slides or is thrown, `gauges` what is measured, `probe` the readings of a measuring head; each is a module of kernels on
plain arrays, in place, serial.
"""

from centering._plant import kernels as machine
from centering._plant import measure_kernels as gauges
from centering._plant import probe_kernels as probe
from centering._plant import ring_kernels as ring
from centering._plant import slide_kernels as slide

__all__ = ["gauges", "machine", "probe", "ring", "slide"]
