"""Risk of a planned sequence: distribution of its penalty on a height grid that is fine near the target.

The policy's table puts outcomes on its nodes. The expected penalty, nearly straight over a cell, stays right;
but the last cuts of a sequence may be smaller than a cell: the table then underrates the probability of
overgrinding several times.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from sdpgrind import sdp
from sdpgrind.base.checks import Floats
from sdpgrind.base.warned import warn

# chosen: cells next to the target and far from it over the greatest height; in between, cell over height
SMALLEST, LARGEST, GROWTH = 1 / 25_600, 1 / 400, 0.02
# chosen: error of a figure that needs no warning, relative, and absolute (probability or $)
LOOSE, RARE = 0.05, 1e-4
_UNITS = {"mean": "$", "overground": "1", "cvar": "$", "passes": "1"}


class Risk:
    """Risk figures of a policy from one state, by a forward recursion.

    The policy is followed as by `SequencePolicy.simulate`: heights need not be nodes of its table.

    Attributes
    ----------
    mean : float
        Expected penalty, $.
    overground : float
        Probability of grinding below the target.
    cvar : float
        Mean penalty of the worst ``1 - confidence`` of the cases (finish, height and lateness charge), $.
    passes : float
        Expected number of passes.
    error : mapping
        Error estimate of each of these figures, in its unit: its change from a grid with half as many
        heights. The error of the plan is `SequencePolicy.error`.
    distribution : sdp.Distribution
        Distribution behind the figures.
    """

    def __init__(self, distribution: sdp.Distribution, confidence: float, coarse: sdp.Distribution) -> None:
        self.distribution, self.confidence = distribution, confidence
        found, other = _figures(distribution, confidence), _figures(coarse, confidence)
        self.mean, self.overground, self.cvar, self.passes = found.values()
        self.error: Mapping[str, float] = {name: abs(value - other[name]) for name, value in found.items()}

    def __repr__(self) -> str:
        return (
            f"Risk(mean {self.mean:.6g} $, overground with probability {self.overground:.4g},"
            f" CVaR at {self.confidence:g}: {self.cvar:.4g} $, {self.passes:.3g} passes)"
        )


def _figures(found: sdp.Distribution, confidence: float) -> dict[str, float]:
    return {
        "mean": found.mean,
        "overground": found.probability_below,
        "cvar": float(found.cvar(confidence)),
        "passes": found.moves,
    }


def risk_of(table: sdp.Policy, state: dict[str, Any], confidence: float) -> Risk:
    """Return the risk figures ($, 1) of a table from one state."""
    axis = table.layout.axes[0]
    heights = nodes_of(axis.high)
    fine, coarse = (table.distribution(nodes=nodes, **state) for nodes in (heights, heights[::2]))
    risk = Risk(fine, confidence, coarse)
    _warn(risk)
    return risk


def nodes_of(high: float) -> Floats:
    """Return nodes from the target to `high`, mm, in growing cells; every other node makes such a row too."""
    nodes = [0.0]
    while nodes[-1] < high:
        nodes.append(nodes[-1] + min(max(GROWTH * nodes[-1], SMALLEST * high), LARGEST * high))
    cells = len(nodes) - 1 + (len(nodes) - 1) % 2
    at = np.interp(np.linspace(0, len(nodes) - 1, cells + 1), np.arange(len(nodes)), nodes) * (
        high / nodes[-1]
    )
    at[-1] = high
    return at


def _warn(risk: Risk) -> None:
    unsure = [
        f"{name} {getattr(risk, name):.3g} by {error:.1g} {_UNITS[name]}"
        for name, error in risk.error.items()
        if error > LOOSE * abs(getattr(risk, name)) + RARE
    ]
    if unsure:
        how = "last cuts are smaller than the cells of the recursion; ask simulate"
        warn(f"risk figures are unsure ({', '.join(unsure)}): {how}")
