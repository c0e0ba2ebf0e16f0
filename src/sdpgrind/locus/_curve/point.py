"""One best point with names and units."""

from dataclasses import dataclass
from typing import Any

from sdpgrind.base.brief import brief
from sdpgrind.base.checks import Floats
from sdpgrind.locus._problem.problem import Problem
from sdpgrind.locus._trace.pieces import Columns


@dataclass(frozen=True, repr=False)
class Point:
    """A best point (units of the problem).

    Attributes
    ----------
    hidden : dict
        The hidden states.
    controls : dict
        The best controls.
    cost : float
        Least cost.
    multipliers : dict
        Of each constraint: cost for a unit of it.
    response, limit : float or dict
        P_c and P_b; by name where there are several constraints.
    slope : dict
        Of each control, by the first hidden state.
    margin : float
        Least curvature of the Lagrangian in directions left free, for controls over their whole ranges; inf where none is left.
    kind : str
        That of the piece: "interior", "locus", "bound" or "vertex".
    clamped : bool
        Whether a state or a measurement beyond the range was taken to its end.
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
    """The one point of a table, by names."""
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
