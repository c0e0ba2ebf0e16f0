"""Pictures of the geometry: readings with their model, the history of a centre."""

from typing import TYPE_CHECKING, Any

from sdpgrind.base.checks import Floats
from sdpgrind.base.extras import need

if TYPE_CHECKING:
    from centering._geometry.estimate import CircleEstimate


def plot_fit(circle: "CircleEstimate", angle: Floats, reading: Floats) -> Any:
    """Draw readings, the model and what it leaves (um) over the spindle angle (private to this package)."""
    figure = need("matplotlib.pyplot", "plot").figure(figsize=(7, 5), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    above.plot(angle, reading, ".")
    below.plot(angle, 1e3 * (reading - circle.reading(angle)), ".")
    above.set(ylabel="reading [mm]")
    below.set(xlabel="spindle angle [rad]", ylabel="residual [um]")
    return figure
