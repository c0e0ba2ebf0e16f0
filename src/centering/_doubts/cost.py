"""Expected time to centre a part, planned again at both ends of each interval of its friction."""

import warnings
from collections.abc import Sequence

from centering._problem.problem import CenteringProblem
from centering.cycle._strategy.as_sdp import Size
from centering.cycle._strategy.outcomes import default_kinds
from centering.cycle._strategy.plan import prepared, solved
from sdpgrind.base.doubts.rows import Doubt
from sdpgrind.base.doubts.stakes import Figure, Stake, stakes, together
from sdpgrind.base.progress import silent
from sdpgrind.identify import Estimate

_SIZE = Size(offsets=32, frictions=3)  # measured: 3 s a plan; the time is known to some 5 %
_EVERY = 3  # chosen: of the kinds of push every third, 4 of 10
_OF_THE_PLAN = ("mu_static", "mu_kinetic")


def of_plan(
    problem: CenteringProblem, rows: Sequence[Doubt], friction: Estimate | None = None
) -> tuple[Figure | None, tuple[Stake, ...]]:
    """Return the expected time, s, as believed and at the ends of each interval; None: no friction told.

    `friction`: estimate of both coefficients, which are last taken over together.
    """
    told = [row for row in rows if row.measured and row.name in _OF_THE_PLAN]
    if not told:
        return None, ()
    start = problem.offset_max / 2
    coarse = f"{_SIZE.offsets} offsets, every third kind of push: known to some 5 %"
    figure = Figure(f"expected time from {start:g} mm", "s", _time(problem, start), coarse)
    found = stakes(told, figure, lambda name, value: _time(problem.replace(**{name: value}), start))
    if friction is None:
        return figure, found
    return figure, together(found, lambda: _time(problem.updated(friction), start))


def _time(problem: CenteringProblem, start: float) -> float:
    """Expected time from an offset (mm), s."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        kinds = default_kinds(problem.limits.push_speed_max)[::_EVERY]
        strategy = solved(prepared(problem, "scheduled", kinds, _SIZE, None, silent), None, silent)
    return float(strategy.value(offset=start))
