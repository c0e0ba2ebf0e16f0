"""Sampled control, shared by the areas: exact sampling, margins, laws that do not wind up.

Thin over `scipy`: what is here is what the areas need beyond it.
"""

from sdpgrind.control._law import Law
from sdpgrind.control._margins import Margins, loop_margins, slope_bandwidth
from sdpgrind.control._qdesign import QLimits, q_design
from sdpgrind.control._sampled import Sampled, continuous, held, ramped, same_sample_time, sampled

__all__ = [
    "Law",
    "Margins",
    "QLimits",
    "Sampled",
    "continuous",
    "held",
    "loop_margins",
    "q_design",
    "ramped",
    "same_sample_time",
    "sampled",
    "slope_bandwidth",
]
