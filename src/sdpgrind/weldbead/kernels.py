"""Hidden physics of a weld bead under the grinder, for the stands of other packages.

A pass obeys `PassCoefficients`, `blamed` and `grinding_power`. `force_table` is the compiled table under
force control, with its state `BeadOnTable`, `Motor`, `GroundBead` and scatter.
"""

from sdpgrind.weldbead._plant import force_table_kernels as force_table
from sdpgrind.weldbead._plant.force_table import IDLE, RESET, BeadOnTable
from sdpgrind.weldbead._plant.force_table_bead import FINE, SPACING, GroundBead, reach
from sdpgrind.weldbead._plant.force_table_truth import Motor, drawn_disc
from sdpgrind.weldbead._plant.truth import PassCoefficients, blamed, grinding_power

__all__ = [
    "FINE",
    "IDLE",
    "RESET",
    "SPACING",
    "BeadOnTable",
    "GroundBead",
    "Motor",
    "PassCoefficients",
    "blamed",
    "drawn_disc",
    "force_table",
    "grinding_power",
    "reach",
]
