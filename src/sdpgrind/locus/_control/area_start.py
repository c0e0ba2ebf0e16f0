"""Start on an area: the best point of hidden states that is feasible for all others."""

import itertools
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.locus._control.readings import STARTS
from sdpgrind.locus._curve.area import Area

NODES = 5  # chosen: places per hidden state beside the corners; more rarely find a start where these do not
ROUNDING = 1e-9  # chosen: share of the spread of a slack; the optima are exact to 1e-10


def start_place(area: Area, start: Any) -> Floats:
    """Return the scaled hidden states (h,) of a start."""
    if isinstance(start, str):
        checks.one_of("start", start, STARTS)
        return feasible_place(area)
    hidden, system = area.problem.hidden, area.system
    if not isinstance(start, Mapping):
        rule = f'"feasible", "learned" or a mapping of {", ".join(hidden)} to numbers'
        raise TypeError(f"start must be {rule}; got {checks.shown(start)}")
    if set(start) != set(hidden):
        raise ValueError(f"start must have {', '.join(hidden)}; got {', '.join(map(str, start))}")
    values = [checks.within(f"start[{name!r}]", start[name], *ends) for name, ends in hidden.items()]
    return system.scaled(np.array(values), system.n)


def feasible_place(area: Area) -> Floats:
    """Return the scaled hidden states whose best controls exceed no limit in the whole range.

    Constraints change one way with each hidden state (`plan` refuses others), so that the corners of the
    range are the worst cases. Corners are tried first; the cheapest of those found is taken.
    """
    h = area.system.h
    for ticks in ((0.0, 1.0), np.linspace(0.0, 1.0, NODES)):
        if (found := _cheapest_safe(area, itertools.product(ticks, repeat=h))) is not None:
            return found
    names = ", ".join(area.problem.hidden_names)
    raise ValueError(
        f'start "feasible" must have a point without violation in the whole range of {names}; there is none:'
        " narrow the ranges, or give hidden states by name"
    )


def _cheapest_safe(area: Area, places: Iterable[tuple[float, ...]]) -> Floats | None:
    """Return the place of the cheapest optimum that is feasible at all corners; None: none is."""
    found: tuple[float, Floats] | None = None
    for place in map(np.array, places):
        try:
            best = area.at(**hidden_at(area, place))
        except ValueError:  # nothing is feasible there
            continue
        if (found is None or best.cost < found[0]) and _is_safe(area, list(best.controls.values())):
            found = best.cost, place
    return None if found is None else found[1]


def _is_safe(area: Area, controls: list[float]) -> bool:
    system = area.system
    corners = np.array(list(itertools.product((0.0, 1.0), repeat=system.h)))
    _, response, limit = system.values(np.array(controls), system.unscaled(corners, system.n))
    return bool(np.all(response - limit <= ROUNDING * system.scales))


def hidden_at(area: Area, place: Floats) -> dict[str, float]:
    """Return hidden states by name, in their units, of a scaled place (h,)."""
    system, hidden = area.system, area.problem.hidden
    low, high = np.array(list(hidden.values())).T
    values = np.clip(system.unscaled(place, system.n), low, high)  # rounding may lead over an end
    return dict(zip(hidden, map(float, values), strict=True))
