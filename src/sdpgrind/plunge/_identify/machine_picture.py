"""Picture of the residuals of a machine's model."""

from typing import TYPE_CHECKING, Any

from sdpgrind.base import pictures
from sdpgrind.base.units import um

if TYPE_CHECKING:
    from sdpgrind.plunge._identify.machine_estimate import MachineEstimate


def plot(machine: "MachineEstimate") -> Any:
    """Draw the residuals of size and power over time, the declared and seen noise in the titles."""
    figure, (top, low) = pictures.subplots(2, 1, (9, 5), sharex=True)
    shown = (machine.size_residual / um(1), "size", "µm"), (machine.power_residual, "power", "W")
    for axis, (residual, name, unit) in zip((top, low), shown, strict=True):
        axis.plot(machine.time, residual, ".", color=pictures.ACTUAL, ms=3)
        axis.axhline(0.0, color=pictures.LIMIT, lw=0.8)
        axis.set_ylabel(pictures.label(f"{name}, read less model", unit))
        axis.set_title(
            f"chi²/dof {machine.fit[f'{name}_chi_square']:.3g}", fontsize=pictures.SMALL, loc="left"
        )
    low.set_xlabel(pictures.label("time", "s"))
    pictures.opened((top, low))
    return figure
