"""Risk of a planned sequence: distribution of its penalty on a height grid that is fine near the target.

The policy's table puts outcomes on its nodes. The expected penalty, nearly straight over a cell, stays right;
but the last cuts of a sequence may be smaller than a cell: the table then underrates the probability of
overgrinding several times.
"""

import json
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
SURE = 1.96  # derived: standard errors that a 95 % interval reaches


class Risk:
    """Risk figures of a policy from one state.

    By a forward recursion, which follows the policy as `SequencePolicy.simulate` does (heights need not be
    nodes of its table); where beads differ, by drawn beads that a controller learns.

    Attributes
    ----------
    mean : float
        Expected penalty, $.
    overground : float
        Probability of grinding below the target.
    cvar : float
        Mean penalty of the worst ``1 - confidence`` of the cases (finish, height and lateness charge; of
        drawn beads the whole penalty), $.
    passes : float
        Expected number of passes.
    finished : float
        Probability that the height left is at most `finished_within`, above or below the target.
    height : float
        Expected height left, mm; < 0: overground.
    learning : float
        What a plan that never learns the bead costs more, $. 0: there is nothing to learn.
    knowing : float
        What knowing the bead's coefficients before the first pass would save, $.
    error : mapping
        Error estimate of each of these figures, in its unit: its change from a grid with half as many
        heights; of drawn beads 1.96 standard errors. The error of the plan is `SequencePolicy.error`.
    confidence : float
        Probability of the CVaR.
    distribution : sdp.Distribution or None
        Distribution behind the figures; None: drawn beads.
    """

    def __init__(
        self,
        figures: Mapping[str, float],
        error: Mapping[str, float],
        confidence: float,
        distribution: sdp.Distribution | None = None,
    ) -> None:
        self.mean, self.overground, self.cvar = (figures[name] for name in ("mean", "overground", "cvar"))
        self.passes, self.finished = figures["passes"], figures["finished"]
        self.height, self.learning = figures["height"], figures["learning"]
        self.knowing = figures["knowing"]
        self.error, self.confidence, self.distribution = error, confidence, distribution

    def __repr__(self) -> str:
        return (
            f"Risk(mean {self.mean:.6g} $, overground with probability {self.overground:.4g},"
            f" CVaR at {self.confidence:g}: {self.cvar:.4g} $, {self.passes:.3g} passes)"
        )


def _figures(found: sdp.Distribution, confidence: float, within: float) -> dict[str, float]:
    finished, height = _ends(found, within)
    return {
        "mean": found.mean,
        "overground": found.probability_below,
        "cvar": float(found.cvar(confidence)),
        "passes": found.moves,
        "finished": finished,
        "height": height,
        "learning": 0.0,
        "knowing": 0.0,
    }


def _ends(found: sdp.Distribution, within: float) -> tuple[float, float]:
    """Probability of ending within an amount (mm) of the target, and expected height left, mm."""
    height, probability = found.final[0], found.probability
    finished, mean = float(probability[np.abs(height) <= within].sum()), float(probability @ height)
    for left in found.tails:  # beyond the target
        law, x = left.tail.law, left.tail.x
        finished += float(left.probability @ (law.over(x, 0) - law.over(x + within, 0)))
        mean -= float(left.probability @ law.over(x, 1))
    return finished, mean


def risk_of(table: sdp.Policy, state: dict[str, Any], confidence: float, within: float) -> Risk:
    """Return the risk figures ($, 1, mm) of a table from one state."""
    axis = table.layout.axes[0]
    heights = nodes_of(axis.high)
    fine, coarse = (table.distribution(nodes=nodes, **state) for nodes in (heights, heights[::2]))
    figures, other = (_figures(each, confidence, within) for each in (fine, coarse))
    error = {name: abs(value - other[name]) for name, value in figures.items()}
    return Risk(figures, error, confidence, fine)


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


def warn_if_unsure(risk: Risk) -> None:
    """Warn of figures whose error is large."""
    unsure = [
        f"{name} {getattr(risk, name):.3g} by {error:.1g} {unit}"
        for name, unit in _UNITS.items()
        if (error := risk.error[name]) > LOOSE * abs(getattr(risk, name)) + RARE
    ]
    if unsure:
        how = "last cuts are smaller than the cells of the recursion; ask simulate"
        warn(f"risk figures are unsure ({', '.join(unsure)}): {how}")


Asked = tuple[float | int | None, ...]
"""What a promise was asked for: height (mm), time left (s), confidence, finish (mm), error ($), seed."""


def as_text(promises: Mapping[Asked, Risk]) -> str:
    """Return promises made as JSON."""
    rows = [
        [asked, {name: getattr(risk, name) for name in risk.error}, dict(risk.error)]
        for asked, risk in promises.items()
    ]
    return json.dumps(rows)


def of_text(text: str) -> dict[Asked, Risk]:
    """Return promises from JSON; the third of what is asked is the confidence."""
    return {tuple(asked): Risk(figures, error, asked[2]) for asked, figures, error in json.loads(text)}
