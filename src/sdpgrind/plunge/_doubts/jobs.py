"""Sizes, commands and durations of parts against stock, greatest rate and plan: what both columns share."""

from collections.abc import Sequence

import numpy as np

from sdpgrind.base.doubts.stakes import Figure
from sdpgrind.base.doubts.words import amount
from sdpgrind.plunge._identify.cycles import Cycle
from sdpgrind.plunge._model.problem import CycleProblem

_NEAR = 0.15  # chosen: relative; stocks of parts differ, and no two factors are nearer than 2
_FACTORS = {
    1 / 25.4: "both columns in inches were read as mm",
    25.4: "both columns in mm were read as inches",
    1e-3: "both columns in m were read as mm",
    1e3: "both columns in µm were read as mm",
    2.0: "both columns of the diameter were read as of the radius",
    0.5: "both columns were halved twice",
}
_ENDS = 5  # chosen: readings of a mean at the start and the end of a part


def against_the_problem(problem: CycleProblem, each: Sequence[Cycle], figure: Figure) -> list[str]:
    """Sentences that compare the parts with the problem."""
    travel = float(np.median([_travel(cycle) for cycle in each]))
    fastest = float(max(cycle.command_rate.max() for cycle in each))
    took = float(np.median([cycle.time[-1] - cycle.time[0] for cycle in each]))
    shares = travel / problem.stock, fastest / problem.command_rate_max
    told = (
        f"Against the problem: size changes by {amount(travel, 'mm', 3)} in a part,"
        f" {100 * shares[0]:.0f} % of the stock; commands reach {amount(fastest, 'mm/s', 3)},"
        f" {100 * shares[1]:.0f} % of command_rate_max; a part took {took:.1f} s, the plan takes"
        f" {figure.value:.1f} s."
    )
    near = [
        words
        for factor, words in _FACTORS.items()
        if all(abs(share / factor - 1) < _NEAR for share in shares)
    ]
    return [told, *(f"Size and rate are off by the same factor, as if {words}." for words in near)]


def _travel(cycle: Cycle) -> float:
    size = cycle.size[cycle.read]
    return float(np.mean(size[-_ENDS:]) - np.mean(size[:_ENDS]))
