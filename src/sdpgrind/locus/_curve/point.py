"""One optimum with names and units."""

from dataclasses import dataclass
from typing import Any

from sdpgrind.base.brief import brief
from sdpgrind.base.checks import Floats
from sdpgrind.locus._problem.problem import Problem
from sdpgrind.locus._trace.pieces import Columns


@dataclass(frozen=True, repr=False)
class Point:
    """An optimum (units of the problem).

    Attributes
    ----------
    hidden : dict
        Hidden states.
    controls : dict
        Optimal controls.
    cost : float
        Least cost.
    multipliers : dict
        Cost per unit of each constraint.
    response, limit : float or dict
        P_c and P_b; by name for several constraints.
    slope : dict
        Slope of each control by the first hidden state.
    margin : float
        Least curvature of the Lagrangian in free directions, controls scaled to their ranges. inf: none.
    kind : str
        Kind of the piece: "interior", "locus", "bound" or "vertex".
    clamped : bool
        Whether a state or measurement out of range was clamped.
    """

    hidden: dict[str, float]
    controls: dict[str, float]
    cost: float
    multipliers: dict[str, float]
    response: Any
    limit: Any
    slope: dict[str, float]
    margin: float
    kind: str
    clamped: bool = False

    def __repr__(self) -> str:
        return brief(self)


def named_point(problem: Problem, hidden: dict[str, float], row: Columns, kind: str, clamped: bool) -> Point:
    """Return the only row of a table as a point."""
    responses = list(problem.responses)

    def by_name(values: Floats) -> Any:
        named = dict(zip(responses, map(float, values[0]), strict=True))
        return named if len(named) > 1 else next(iter(named.values()))

    controls, slope = (
        dict(zip(problem.names, map(float, values[0]), strict=True)) for values in (row.controls, row.slope)
    )
    multipliers = dict(zip(responses, map(float, row.multipliers[0]), strict=True))
    response, limit = by_name(row.response), by_name(row.limit)
    return Point(
        hidden,
        controls,
        float(row.cost[0]),
        multipliers,
        response,
        limit,
        slope,
        float(row.margin[0]),
        kind,
        clamped,
    )
