"""Compiled look-ups for fast loops and for other compiled code; arrays are filled in place.

``look_up(table.packed, key, out)`` fills ``out`` with the columns of a `Locus.table` at a key.
``retrieve(inversion.packed, controls, measured, out)`` fills it with hidden state and optimal controls for a
response measured at ``controls`` (tuple of floats, or array). Both return ``INSIDE``, ``BELOW`` or ``ABOVE``
(clamped), or ``NO_KEY``. `best_rates` within `Ranges` is the burn-free optimum of a simulated
grinder; `GroundPart` is a part on it.
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
