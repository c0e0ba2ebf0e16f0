"""Hidden physics of a weld bead under the grinder, for the stands of other packages.

A pass obeys `PassCoefficients`, `blamed` and `grinding_power`. `force_table` is the compiled table under
force control, with its state `BeadOnTable`, `Motor`, `GroundBead` and scatter. `NOISES`: range of the noise
of a scan, mm; `check_units` refuses a process in other units.
"""

from sdpgrind.weldbead._plant import force_table_kernels as force_table
from sdpgrind.weldbead._plant.force_table import IDLE, RESET, BeadOnTable
from sdpgrind.weldbead._plant.force_table_bead import FINE, SPACING, GroundBead, reach
from sdpgrind.weldbead._plant.force_table_truth import Motor, drawn_disc
from sdpgrind.weldbead._plant.truth import PassCoefficients, blamed, grinding_power
from sdpgrind.weldbead.sequence._problem import NOISES
from sdpgrind.weldbead.sequence._process import check_units

__all__ = [
    "FINE",
    "IDLE",
    "NOISES",
    "RESET",
    "SPACING",
    "BeadOnTable",
    "GroundBead",
    "Motor",
    "PassCoefficients",
    "blamed",
    "check_units",
    "drawn_disc",
    "force_table",
    "grinding_power",
    "reach",
]
