"""Share of the error removed per sample over several hidden states: noise of readings against drift."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np
from scipy.special import ndtri

from sdpgrind.base import checks
from sdpgrind.base.frozen import Frozen
from sdpgrind.locus._curve.area import Area

CONFIDENCE = 0.999  # chosen: one sample of a thousand over a limit, as in plunge grinding


@dataclass(frozen=True)
class AreaDesign(Frozen):
    """Share of errors and margins for noise and drift of the readings, from `design_gain` of an `Area`.

    An error n of a reading moves the slack by -theta n, a drift by -d. So the slack e follows
    (1 - theta) e - theta n - d: its standard deviation is (theta/(2 - theta))^(1/2) times that of n, its mean
    -d/theta. The margin is z times the first plus the second; z is the quantile of the confidence.

    Attributes
    ----------
    theta : float
        Share (0, 1] of each error removed per sample.
    margin : dict
        Distance kept from each limit, by name of the response, in its unit.
    cost : float
        Mean cost of the margins over the area, in the unit of the cost: sum of multiplier times margin.
    confidence : float
        Probability that a sample keeps a limit.

    Examples
    --------
    >>> from sdpgrind import locus
    >>> area = locus.plan(locus.preset("grinding-roughness"))
    >>> noise = {"grinding_power": 10.0, "roughness": 8e-6}  # standard deviations, W and mm
    >>> design = locus.gains.design_gain(area, noise=noise, drift={"grinding_power": 1.0})
    >>> round(design.theta, 3), round(design.margin["grinding_power"], 1)  # share, W
    (0.149, 15.5)
    """

    theta: float
    margin: dict[str, float]
    cost: float
    confidence: float


def design_area(
    area: Area, noise: Mapping[str, float] | None, drift: Mapping[str, float] | None, confidence: float
) -> AreaDesign:
    """Return the share with the least mean cost of the margins, and these margins."""
    sds, drifts = by_response("noise", noise or {}, area), by_response("drift", drift or {}, area)
    charged, z = mean_multipliers(area), quantile(confidence)
    scattered = z * sum(charged[name] * sd for name, sd in sds.items())
    behind = sum(charged[name] * fall for name, fall in drifts.items())
    if behind <= 0:
        raise ValueError(
            "drift must be > 0 for a response whose limit is active somewhere: without drift the least"
            f" theta is best; got {dict(drifts)!r}"
        )
    theta = _best_theta(scattered, behind)
    margin = margins(area, theta, sds, drifts, confidence)
    cost = sum(charged[name] * value for name, value in margin.items())
    return AreaDesign(theta, margin, cost, confidence)


def _best_theta(scattered: float, behind: float) -> float:
    """Return the theta in (0, 1] of the least scattered sqrt(theta/(2 - theta)) + behind/theta.

    Its slope is 0 where (theta/(2 - theta))^(3/2) = behind/scattered, and only there.
    """
    if behind >= scattered:
        return 1.0
    ratio = float((behind / scattered) ** (2 / 3))
    return 2 * ratio / (1 + ratio)


def margins(
    area: Area, theta: float, noise: Mapping[str, float], drift: Mapping[str, float], confidence: float
) -> dict[str, float]:
    """Return the margin of each response: z sqrt(theta/(2 - theta)) noise + drift/theta, in its unit."""
    spread = quantile(confidence) * sqrt(theta / (2 - theta))
    return {
        name: spread * noise.get(name, 0.0) + drift.get(name, 0.0) / theta
        for name in area.responses
        if noise.get(name) or drift.get(name)
    }


def quantile(confidence: float) -> float:
    """Return the standard normal quantile z of a confidence in [0.5, 1)."""
    return float(ndtri(checks.confidence("confidence", confidence)))


def by_response(name: str, given: Any, area: Area) -> dict[str, float]:
    """Return numbers >= 0 by response, in their units."""
    if not isinstance(given, Mapping):
        known = ", ".join(area.responses)
        raise TypeError(f"{name} must be a mapping of responses ({known}) to numbers; got {given!r}")
    for response in given:
        checks.one_of(name, response, area.responses)
    return {
        response: checks.nonnegative(f"{name}[{response!r}]", value, area.problem.unit(response))
        for response, value in given.items()
    }


def mean_multipliers(area: Area) -> dict[str, float]:
    """Return the mean cost for a unit of each limit over the known nodes of the grid."""
    multipliers = area.grid.table(area.system).multipliers[area.known.ravel()]
    return dict(zip(area.responses, map(float, np.mean(multipliers, axis=0)), strict=True))
