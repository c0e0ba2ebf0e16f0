"""Compiled look-ups for loops in which every microsecond counts, and for compiled code: arrays in place, serial.

``look_up(table.packed, key, out)`` puts the columns of a `Locus.table` at a key into ``out``;
``retrieve(inversion.packed, controls, measured, out)`` the hidden state that a measurement at ``controls`` (a tuple of floats, or
an array) tells of, and the best controls for it. Both say where the number was: ``INSIDE``, ``BELOW`` or ``ABOVE`` the range,
whose end is taken, or ``NO_KEY``. `best_rates` within `Ranges` is what a simulated grinder could do at best;
`GroundPart` is a part on it.
"""

from sdpgrind.locus._curve.inversion_kernels import retrieve
from sdpgrind.locus._plant.part import GroundPart, InfeedCourse
from sdpgrind.locus._plant.truth import Ranges, best_rates
from sdpgrind.locus._trace.table_kernels import ABOVE, BELOW, INSIDE, NO_KEY, look_up

__all__ = [
    "ABOVE",
    "BELOW",
    "INSIDE",
    "NO_KEY",
    "GroundPart",
    "InfeedCourse",
    "Ranges",
    "best_rates",
    "look_up",
    "retrieve",
]
