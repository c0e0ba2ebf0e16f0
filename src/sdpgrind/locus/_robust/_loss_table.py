"""What several models lose on a locus, with feedback and without."""

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from sdpgrind.base.checks import Floats
from sdpgrind.locus._curve.locus import Locus
from sdpgrind.locus._stretch.inverse import root
from sdpgrind.locus._stretch.stretch import Stretch

if TYPE_CHECKING:
    from sdpgrind.locus._robust.robust import RobustLocus

WAYS = ("nominal", "robust", "open loop")


def loss_table(robust: "RobustLocus", points: int, bias: float) -> xr.Dataset:
    """Loss and violation by sample, way and hidden state; unknown where a sample has no optimum."""
    path = robust.path
    x = np.linspace(*robust.x, points)
    nominal = _optima(robust.curves[0], x)[0]
    loss, violation = np.empty((2, len(robust.samples), len(WAYS), points))
    for j, curve in enumerate(robust.curves):
        least = _optima(curve, x)[1]
        ways = (feedback_points(robust.nominal, curve, x, bias), feedback_points(path, curve, x, bias), nominal)
        for k, controls in enumerate(ways):
            cost, response, limit = curve.system.values(controls, x[:, None])
            loss[j, k], violation[j, k] = cost - least, response[:, 0] - limit[:, 0]
    dims, unit = ("sample", "way", path.hidden_name), path.units[path.response]
    return xr.Dataset(
        {
            "loss": (dims, loss, {"long_name": "cost beyond the optimum of the sample", "units": robust.samples[0].unit("cost")}),
            "violation": (dims, violation, {"long_name": f"{path.response} beyond its limit", "units": unit}),
        },
        {
            "sample": np.arange(len(robust.samples)),
            "way": list(WAYS),
            path.hidden_name: (path.hidden_name, x, {"units": path.units[path.hidden_name], "long_name": "hidden state"}),
        },
        {"bias": bias, "objective": robust.objective},
    )


def feedback_points(stretch: Stretch, truth: Locus, x: Floats, bias: float = 0.0) -> Floats:
    """Controls (k, n) at which feedback on a stretch stops a true process for hidden states (k,).

    That is where the reading meets the computed limit, or the end next to it.
    """

    def slack(s: Floats) -> Floats:
        controls = stretch.rows(s)[:, : len(stretch.names)]
        response = truth.system.values(controls, x[:, None])[1][:, 0]
        return np.asarray(stretch.values(controls, x)[1] - response - bias)

    places = root(slack, np.full(x.shape, stretch.low), np.full(x.shape, stretch.high))
    return stretch.rows(places)[:, : len(stretch.names)]


def _optima(curve: Locus, x: Floats) -> tuple[Floats, Floats]:
    """Controls (k, n) and cost (k,) of the optima; NaN where there is none."""
    controls, cost = np.full((len(x), len(curve.names)), np.nan), np.full(len(x), np.nan)
    for k, state in enumerate(x):
        if curve.range[0] <= state <= curve.range[1]:
            point = curve.at(**dict[str, Any]({curve.hidden_name: float(state)}))
            controls[k], cost[k] = list(point.controls.values()), point.cost
    return controls, cost
